#pragma once

#include <string>
#include <utility>
#include <vector>

namespace demslam {

/// One line of a plot.
struct PlotSeries {
  std::string label, colour;                      ///< colour as CSS writes it
  std::vector<std::pair<double, double>> points;  ///< x, y
};

struct LinePlot {
  std::string title, x_label, y_label;  ///< labels carry their units
  std::vector<PlotSeries> series;
  int width = 900, height = 320;  ///< pixels
  bool log_y = false;             ///< decades; what is not positive is left out
};

/// A self-contained SVG document with axes, ticks at round numbers and a legend.
std::string to_svg(const LinePlot& plot);

/// About `count` round numbers (1, 2, 5 x 10^n apart) that cover [low, high].
std::vector<double> round_ticks(double low, double high, int count);

}  // namespace demslam
