#pragma once

#include <filesystem>

#include "demslam/store/map_store.h"
#include "demslam/store/sqlite.h"

namespace demslam {

/// Makes the file with its tables and its header; it appears under its name only when it is complete.
void create_map_file(const std::filesystem::path& file, const MapHeader& header);

/// Opens an existing map for reading or writing. Throws Error, the file untouched, unless it is a sound map of a schema
/// that is known here. What takes long (the features of every keyframe) is left to check_map.
Database open_map_file(const std::filesystem::path& file, OpenMode mode);

}  // namespace demslam
