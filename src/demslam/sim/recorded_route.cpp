#include "demslam/sim/recorded_route.h"

#include <fstream>
#include <sstream>
#include <string>

#include "demslam/base/error.h"

namespace demslam {

std::vector<Eigen::Vector2d> recorded_places(const std::filesystem::path& file) {
  constexpr double kApart = 1.0;  // metres
  std::ifstream stream(file);
  if (!stream) throw Error(file.string() + ": the recorded route cannot be read");
  std::vector<Eigen::Vector2d> places;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    if (line.empty() || line.front() == '#') continue;
    std::istringstream columns(line);
    double time_s = 0.0, x = 0.0, y = 0.0, z = 0.0;
    if (!(columns >> time_s >> x >> y >> z)) {
      throw Error::at(file.string(), number, "no TUM line (seconds x y z qx qy qz qw)");
    }
    if (places.empty() || (Eigen::Vector2d(x, y) - places.back()).norm() >= kApart) places.emplace_back(x, y);
  }
  if (places.size() < 2) throw Error(file.string() + ": the recorded route is shorter than a metre");
  return places;
}

}  // namespace demslam
