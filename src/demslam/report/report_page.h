#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include "demslam/report/run_report.h"

namespace demslam {

/// How much a page may hold. With the defaults a page of any run stays below 20 MB (tests/web, docs/report.md).
struct PageOptions {
  std::size_t images = 160;  ///< keyframe images, all runs together, evenly along the path; 0: none
  int image_width_px = 384;
  int image_quality = 72;            ///< JPEG
  std::size_t features = 400;        ///< the best ones of each image
  std::size_t rows = 16000;          ///< of every table over frames, all runs together; peaks are kept
  std::size_t track_points = 20000;  ///< of all runs together
  int terrain_side = 384;            ///< posts
  bool live = false;                 ///< the page asks for news of a run that goes on (live_server.h)
};

/// Keyframe images by dataset and time, JPEG in base64, kept from one page to the next.
using ImageCache = std::map<std::pair<std::string, TimestampNs>, std::string>;

/// Everything a page shows, as JSON (docs/report.md). What is missing (DEM, images, map.db) is left out and noted.
std::string page_data(const Report& report, const PageOptions& options = {}, ImageCache* cache = nullptr);

/// The page of this build around `data`. Throws Error when demslam was built without it.
std::string page_with(const std::string& data);

/// One self-contained HTML page; opens offline. Throws Error.
void write_html(const Report& report, const std::filesystem::path& file, const PageOptions& options = {});

}  // namespace demslam
