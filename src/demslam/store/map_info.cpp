#include "demslam/store/map_info.h"

#include "demslam/geometry/trajectory.h"
#include "demslam/store/map_store.h"
#include "demslam/store/schema.h"

namespace demslam {
namespace {

double length_m(const MapStore& store) {
  Trajectory track;
  for (const StoredEstimate& estimate : store.estimates()) track.push_back({0, estimate.T_map_body});
  return path_length_m(track);
}

}  // namespace

MapInfo map_info(const std::filesystem::path& file) {
  const MapStore store = MapStore::open_read_only(file);
  Database database = open_map_file(file, OpenMode::read);
  const auto count = [&](const char* sql) { return static_cast<std::size_t>(database.integer(sql)); };
  return {.schema = static_cast<int>(database.integer("PRAGMA user_version")),
          .version = store.header().version,
          .keyframes = store.keyframe_count(),
          .frames = count("SELECT count(*) FROM frames"),
          .odometry_factors = count("SELECT count(*) FROM factors WHERE kind = 'odometry'"),
          .loops = count("SELECT count(*) FROM factors WHERE kind = 'loop'"),
          .loops_accepted = count("SELECT count(*) FROM factors WHERE kind = 'loop' AND status = 'accepted'"),
          .features = count("SELECT total(count) FROM features"),
          .landmarks = count("SELECT total(with_depth) FROM features"),
          .descriptor_width = static_cast<int>(database.integer("SELECT max(width) FROM features")),
          .length_m = length_m(store),
          .duration_s = to_seconds(database.integer("SELECT max(t_ns) - min(t_ns) FROM frames")),
          .file_bytes = database.integer("SELECT page_count * page_size FROM pragma_page_count, pragma_page_size")};
}

}  // namespace demslam
