#include "demslam/store/schema.h"

#include <format>

#include "demslam/base/error.h"
#include "demslam/store/blob.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kApplication = 0x64656d73;  // "dems"
constexpr int kPageBytes = 16384;                   // features are large: fewer links between pages

/// Arrays are little-endian (blob.h). Features have a table of their own, so that the others stay small and quick to
/// check.
constexpr const char* kTables = R"sql(
CREATE TABLE meta (key TEXT PRIMARY KEY, value BLOB NOT NULL) WITHOUT ROWID;
CREATE TABLE keyframes (
  id INTEGER PRIMARY KEY, frame INTEGER NOT NULL, t_ns INTEGER NOT NULL,
  T_map_body_first BLOB NOT NULL, T_map_body_odometry BLOB NOT NULL, payload BLOB NOT NULL);
CREATE TABLE features (
  keyframe INTEGER PRIMARY KEY REFERENCES keyframes (id),
  count INTEGER NOT NULL, width INTEGER NOT NULL, with_depth INTEGER NOT NULL,
  image_width INTEGER NOT NULL, image_height INTEGER NOT NULL,
  keypoints BLOB NOT NULL, scores BLOB NOT NULL, disparities_px BLOB NOT NULL,
  scales BLOB, descriptors BLOB NOT NULL);
CREATE TABLE factors (
  id INTEGER PRIMARY KEY, kind TEXT NOT NULL,
  i INTEGER NOT NULL REFERENCES keyframes (id), j INTEGER NOT NULL REFERENCES keyframes (id),
  T_i_j BLOB NOT NULL, covariance BLOB NOT NULL, status TEXT NOT NULL, chi_square REAL, inliers INTEGER NOT NULL);
CREATE TABLE frames (
  id INTEGER PRIMARY KEY, t_ns INTEGER NOT NULL, status TEXT NOT NULL,
  keyframe INTEGER NOT NULL REFERENCES keyframes (id), T_keyframe_body BLOB NOT NULL, record TEXT NOT NULL);
CREATE TABLE estimates (keyframe INTEGER PRIMARY KEY REFERENCES keyframes (id), T_map_body BLOB NOT NULL);
CREATE TABLE final_estimates (
  keyframe INTEGER PRIMARY KEY REFERENCES keyframes (id), T_map_body BLOB NOT NULL, covariance BLOB);
CREATE TABLE checkpoint (
  id INTEGER PRIMARY KEY CHECK (id = 0), keyframe INTEGER NOT NULL REFERENCES keyframes (id), state BLOB NOT NULL);
)sql";

constexpr auto kSmallTables = {"meta", "keyframes", "factors", "frames", "estimates", "final_estimates", "checkpoint"};

void write_header(Database& database, const MapHeader& header) {
  Statement insert = database.prepare("INSERT INTO meta VALUES (?, ?)");
  const auto put = [&](const char* key, const std::string& value) {
    insert.bind_text(1, key).bind_blob(2, value).run();
  };
  put("version", header.version);
  put("config_toml", header.config_toml);
  put("inputs", header.inputs);
  put("rig", blob_of(header.rig));
}

void write_tables(const fs::path& file, const MapHeader& header) {
  Database database(file, OpenMode::create);
  database.execute(
      std::format("PRAGMA page_size = {}; PRAGMA application_id = {}; PRAGMA user_version = {}; "
                  "PRAGMA journal_mode = WAL",
                  kPageBytes, kApplication, kMapSchema));
  Transaction transaction(database);
  database.execute(kTables);
  write_header(database, header);
  transaction.commit();
}

bool is_there(const fs::path& file) {
  std::error_code unreadable;
  return fs::exists(file, unreadable);
}

void check_identity(const fs::path& file, const Database& database) {
  const auto header = database.header();
  if (!header || header->application != kApplication) throw Error(file.string() + ": is not a demslam map");
  if (header->schema > kMapSchema) {
    throw Error(std::format("{}: has schema {}, made by a newer demslam; this one ({}) reads up to {}: update demslam",
                            file.string(), header->schema, kVersion, kMapSchema));
  }
  if (header->page_bytes == 0 || database.file_bytes() % header->page_bytes != 0) {
    throw Error(file.string() + ": is cut short; restore a copy, or remove it and run again");
  }
}

void check_small_tables(const fs::path& file, Database& database) {
  for (const char* table : kSmallTables) {
    const std::string finding = database.string(std::format("PRAGMA quick_check({})", table));
    if (finding != "ok") {
      throw Error(std::format("{}: is damaged ({}: {}); restore a copy, or remove it and run again", file.string(),
                              table, finding.substr(0, finding.find('\n'))));
    }
  }
}

}  // namespace

void create_map_file(const fs::path& file, const MapHeader& header) {
  if (is_there(file)) throw Error(file.string() + ": exists already; resume it or choose another run folder");
  const fs::path temporary = file.string() + ".new";
  std::error_code error;
  fs::remove(temporary, error);
  write_tables(temporary, header);
  fs::rename(temporary, file, error);
  if (error) throw Error(file.string() + ": cannot be made (" + error.message() + ")");
}

Database open_map_file(const fs::path& file, OpenMode mode) {
  if (!is_there(file)) throw Error(file.string() + ": no such map, or its folder may not be entered");
  Database database(file, mode);
  database.checkpoint_on_close(false);  // until the map has proved sound, nothing is written to it
  check_identity(file, database);
  if (mode == OpenMode::write && database.is_read_only()) {
    throw Error(file.string() + ": may not be written; check its permissions or copy it");
  }
  check_small_tables(file, database);
  return database;
}

}  // namespace demslam
