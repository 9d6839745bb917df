#include "demslam/report/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace demslam {
namespace {

constexpr double kLeft = 64.0, kRight = 16.0, kTop = 40.0, kBottom = 44.0;

/// Data to pixels.
struct Axes {
  double x_low = 0.0, x_high = 1.0, y_low = 0.0, y_high = 1.0;
  int width, height;

  double u(double x) const { return kLeft + (x - x_low) / (x_high - x_low) * (width - kLeft - kRight); }
  double v(double y) const { return height - kBottom - (y - y_low) / (y_high - y_low) * (height - kTop - kBottom); }
};

Axes axes_of(const LinePlot& plot) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double x_low = kInfinity, x_high = -kInfinity, y_low = 0.0, y_high = -kInfinity;
  for (const PlotSeries& series : plot.series) {
    for (const auto& [x, y] : series.points) {
      x_low = std::min(x_low, x), x_high = std::max(x_high, x);
      y_low = std::min(y_low, y), y_high = std::max(y_high, y);
    }
  }
  if (!(x_high > x_low)) x_low = 0.0, x_high = 1.0;
  if (!(y_high > y_low)) y_high = y_low + 1.0;
  return {x_low, x_high, y_low, round_ticks(y_low, y_high, 5).back(), plot.width, plot.height};
}

std::string text(double u, double v, const std::string& anchor, const std::string& words,
                 const std::string& more = "") {
  return fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="{}" {}>{}</text>)", u, v, anchor, more, words) + "\n";
}

std::string grid(const Axes& axes) {
  std::string svg;
  for (const double y : round_ticks(axes.y_low, axes.y_high, 5)) {
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
  for (const auto& [x, y] : series.points) points += fmt::format("{:.1f},{:.1f} ", axes.u(x), axes.v(y));
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
  std::string svg = fmt::format(R"(<svg class="plot" viewBox="0 0 {} {}" role="img" aria-label="{}">)", plot.width,
                                plot.height, plot.title) +
                    "\n" + text(kLeft, 22.0, "start", plot.title, "class=\"title\"") + grid(axes);
  svg += text(0.5 * (kLeft + plot.width), plot.height - 8.0, "middle", plot.x_label);
  svg += text(14.0, 0.5 * plot.height, "middle", plot.y_label,
              fmt::format("transform=\"rotate(-90 14 {})\"", 0.5 * plot.height));
  double legend_u = plot.width - kRight;
  for (const PlotSeries& series : plot.series) {
    svg += line(series, axes);
    svg += text(legend_u, 22.0, "end", series.label, fmt::format("fill=\"{}\" class=\"legend\"", series.colour));
    legend_u -= 12.0 + 8.0 * static_cast<double>(series.label.size());
  }
  return svg + "</svg>\n";
}

}  // namespace demslam
