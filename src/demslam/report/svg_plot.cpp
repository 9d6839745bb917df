#include "demslam/report/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace demslam {
namespace {

constexpr double kLeft = 64.0, kRight = 16.0, kTop = 40.0, kBottom = 44.0;

constexpr const char* kStyle =
    "<style>text{font:13px sans-serif;fill:#333}.title{font-weight:bold}.grid{stroke:#ddd}</style>"
    "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n";

/// Data to pixels.
struct Axes {
  double x_low = 0.0, x_high = 1.0, y_low = 0.0, y_high = 1.0;  ///< y as drawn: logarithms where the axis is
  int width, height;
  bool log_y;

  bool shows(double y) const { return !log_y || y > 0.0; }
  double drawn(double y) const { return log_y ? std::log10(y) : y; }
  double u(double x) const { return kLeft + (x - x_low) / (x_high - x_low) * (width - kLeft - kRight); }
  double v(double y) const {
    return height - kBottom - (drawn(y) - y_low) / (y_high - y_low) * (height - kTop - kBottom);
  }
};

Axes axes_of(const LinePlot& plot) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Axes axes{kInfinity, -kInfinity, plot.log_y ? kInfinity : 0.0, -kInfinity, plot.width, plot.height, plot.log_y};
  for (const PlotSeries& series : plot.series) {
    for (const auto& [x, y] : series.points) {
      if (!axes.shows(y)) continue;
      axes.x_low = std::min(axes.x_low, x), axes.x_high = std::max(axes.x_high, x);
      axes.y_low = std::min(axes.y_low, axes.drawn(y)), axes.y_high = std::max(axes.y_high, axes.drawn(y));
    }
  }
  if (!(axes.x_high > axes.x_low)) axes.x_low = 0.0, axes.x_high = 1.0;
  if (!std::isfinite(axes.y_low)) axes.y_low = 0.0;
  if (plot.log_y) axes.y_low = std::floor(axes.y_low);
  if (!(axes.y_high > axes.y_low)) axes.y_high = axes.y_low + 1.0;
  axes.y_high = plot.log_y ? std::ceil(axes.y_high) : round_ticks(axes.y_low, axes.y_high, 5).back();
  return axes;
}

std::vector<double> y_ticks(const Axes& axes) {
  if (!axes.log_y) return round_ticks(axes.y_low, axes.y_high, 5);
  std::vector<double> decades;
  for (double power = axes.y_low; power <= axes.y_high; power += 1.0) decades.push_back(std::pow(10.0, power));
  return decades;
}

std::string text(double u, double v, const std::string& anchor, const std::string& words,
                 const std::string& more = "") {
  return fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}" {}>{}</text>)", u, v, anchor, more, words) + "\n";
}

std::string grid(const Axes& axes) {
  std::string svg;
  for (const double y : y_ticks(axes)) {
    svg += fmt::format(R"(<line class="grid" x1="{}" x2="{}" y1="{:.1f}" y2="{:.1f}"/>)", kLeft, axes.width - kRight,
                       axes.v(y), axes.v(y));
    svg += text(kLeft - 8.0, axes.v(y) + 4.0, "end", fmt::format("{:g}", y));
  }
  for (const double x : round_ticks(axes.x_low, axes.x_high, 8)) {
    if (x > axes.x_high) continue;
    svg += text(axes.u(x), axes.height - kBottom + 18.0, "middle", fmt::format("{:g}", x));
  }
  return svg;
}

std::string line(const PlotSeries& series, const Axes& axes) {
  std::string points;
  for (const auto& [x, y] : series.points) {
    if (axes.shows(y)) points += fmt::format("{:.1f},{:.1f} ", axes.u(x), axes.v(y));
  }
  return fmt::format(R"(<polyline fill="none" stroke="{}" stroke-width="2" points="{}"/>)", series.colour, points) +
         "\n";
}

}  // namespace

std::vector<double> round_ticks(double low, double high, int count) {
  const double rough = (high - low) / std::max(count, 1), power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (const double factor : {5.0, 2.0, 1.0}) {
    if (factor * power >= rough * 0.999) step = factor * power;
  }
  std::vector<double> ticks;
  for (double tick = std::ceil(low / step - 1e-9) * step; tick < high + step * (1.0 - 1e-9); tick += step) {
    ticks.push_back(std::abs(tick) < 1e-12 * step ? 0.0 : tick);
  }
  return ticks;
}

std::string to_svg(const LinePlot& plot) {
  const Axes axes = axes_of(plot);
  std::string svg =
      fmt::format(R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {} {}" role="img" aria-label="{}">)",
                  plot.width, plot.height, plot.title) +
      "\n" + kStyle + text(kLeft, 22.0, "start", plot.title, "class=\"title\"") + grid(axes);
  svg += text(0.5 * (kLeft + plot.width), plot.height - 8.0, "middle", plot.x_label);
  svg += text(14.0, 0.5 * plot.height, "middle", plot.y_label,
              fmt::format("transform=\"rotate(-90 14 {})\"", 0.5 * plot.height));
  double legend_u = plot.width - kRight;
  for (const PlotSeries& series : plot.series) {
    svg += line(series, axes);
    svg += text(legend_u, 22.0, "end", series.label, fmt::format("style=\"fill:{}\"", series.colour));
    legend_u -= 12.0 + 8.0 * static_cast<double>(series.label.size());
  }
  return svg + "</svg>\n";
}

}  // namespace demslam
