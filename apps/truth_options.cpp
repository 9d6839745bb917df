#include "truth_options.h"

#include <map>
#include <optional>
#include <string>

namespace demslam::apps {

CLI::Option* add_datum_option(CLI::App& command, const std::string& name, std::optional<HeightDatum>& datum,
                              const std::string& description) {
  return command
      .add_option_function<std::string>(
          name, [&datum](const std::string& word) { datum = height_datum_named(word); }, description)
      ->check(CLI::IsMember({"radius", "sphere", "ellipsoid", "geoid"}));
}

void add_geodetic_options(CLI::App& command, TruthOptions& options) {
  command.add_option("--dem", options.dem, "DEM whose map longitudes and latitudes go to; default: the run's own");
  add_datum_option(command, "--dem-heights", options.dem_heights,
                   "what the DEM's heights count from: radius, sphere, ellipsoid or geoid");
  command.add_option("--geoid-undulation-m", options.geoid_undulation_m,
                     "geoid above the ellipsoid there, with heights above a geoid");
  command.add_option("--worst-quality", options.worst_quality, "satellite fixes of a larger RTKLIB Q are left out");
}

void add_clock_offset(CLI::App& command, TruthOptions& options) {
  command.add_option_function<std::string>(
      "--clock-offset-s",
      [&options](const std::string& word) {
        options.estimate_clock_offset = word == "auto";
        if (!options.estimate_clock_offset && !CLI::detail::lexical_cast(word, options.clock_offset_s)) {
          throw CLI::ConversionError("--clock-offset-s: seconds, or auto");
        }
      },
      "seconds added to the estimate's stamps, or auto: from the aligned positions");
}

}  // namespace demslam::apps
