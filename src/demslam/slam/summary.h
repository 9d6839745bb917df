#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "demslam/dataset/sequence.h"
#include "demslam/slam/run.h"

namespace demslam {

/// The map itself, where a run folder stands for it.
std::filesystem::path map_file(const std::filesystem::path& map_or_run);

/// What may bridge bad frames, imu.txt and wheels.txt, and what tells the heading, sun.csv, of a demslam dataset, where
/// they are there and switched on.
struct SensorFiles {
  std::optional<std::filesystem::path> imu, wheels, sun;
};
SensorFiles sensor_files(const RunInputs& inputs, const StereoSequence& sequence, const SlamOptions& options);

/// The uncertainty raster of a DEM: the one asked for, else the one beside it, if there is one.
std::optional<std::filesystem::path> sigma_file(const RunInputs& inputs,
                                                const std::optional<std::filesystem::path>& dem);

/// What a run reads, with SHA-256: dataset, calibration, start, DEM, sensors, models, and who runs the models
/// (Frontend::inference) where that is not ONNX Runtime. JSON.
std::string inputs_text(const RunInputs& inputs, const StereoSequence& sequence,
                        const std::optional<std::filesystem::path>& dem, const SlamOptions& options,
                        const std::string& inference);

/// The same inputs with another DEM, or none.
std::string with_dem(const std::string& inputs_text, const std::optional<std::filesystem::path>& dem,
                     const std::optional<std::filesystem::path>& dem_sigma);

/// The text of summary.json.
std::string summary_text(const RunInputs& inputs, const std::string& inputs_text, const RunReport& report);

/// Whether summary.json tells of a run that has come as far as `end`, one behind its last frame.
bool is_finished(const std::string& summary, std::size_t end);

/// Throws Error that names the first difference between what an earlier part of a run had read and been set to, and
/// what is asked now. Where files lie does not matter.
void check_same_run(const std::filesystem::path& run, const std::string& earlier_inputs, const std::string& inputs,
                    const std::string& earlier_config, const std::string& config);

}  // namespace demslam
