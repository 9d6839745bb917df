#pragma once

// LuSNAR and S3LI cannot be shipped: a simulated traverse is written to their documented layouts byte by byte.
#include <filesystem>
#include <string>
#include <vector>

#include "demslam/dataset/compression.h"
#include "demslam/geometry/trajectory.h"
#include "demslam/image/image.h"

namespace demslam::testing_support {

/// A PNG of 8-bit RGBA as LuSNAR's renderer writes them; the pixels are stored without compression.
std::string rgba_png(const Image& grey);

/// LuSNAR's Moon_N: image{0,1}/color, image0/depth, LiDAR, gt.txt, imu.txt in a world whose z points down; the rover
/// frame is forward, right, down. `simulated` is a dataset of `demslam simulate` with every sensor.
void write_lusnar(const std::filesystem::path& simulated, const std::filesystem::path& folder);

/// What an S3LI traverse is made of besides the simulated dataset.
struct EtnaOptions {
  Compression compression = Compression::none;
  double clock_offset_s = 16.7;       ///< GPS time - bag time
  double geoid_undulation_m = 43.46;  ///< geoid above the ellipsoid
};

/// S3LI's traverse: crater.bag (some frames lack their partner), global_lle.pos at 5 Hz, dsm.tif in UTM with heights
/// above the geoid and no word about it.
void write_etna(const std::filesystem::path& simulated, const std::filesystem::path& folder,
                const EtnaOptions& options);

}  // namespace demslam::testing_support
