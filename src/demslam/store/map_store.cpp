#include "demslam/store/map_store.h"

#include <cassert>

#include "demslam/base/error.h"
#include "demslam/store/blob.h"
#include "demslam/store/features_table.h"
#include "demslam/store/schema.h"
#include "demslam/store/writer_lock.h"

namespace demslam {
namespace {

/// Commits wait for no disk: a killed process loses nothing, a power cut at most the last keyframes, and never halves
/// one.
constexpr const char* kWriterSettings =
    "PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL; PRAGMA foreign_keys = ON; PRAGMA wal_autocheckpoint = "
    "1000";

std::string to_text(FactorKind kind) { return kind == FactorKind::loop ? "loop" : "odometry"; }
FactorKind kind_of(std::string_view text) { return text == "loop" ? FactorKind::loop : FactorKind::odometry; }

/// The statements of `append`, prepared once.
struct Inserts {
  Statement keyframe, features, factor, factor_status, frame, estimate, final_estimate, checkpoint;

  explicit Inserts(Database& database)
      : keyframe(database.prepare("INSERT INTO keyframes VALUES (?, ?, ?, ?, ?, ?)")),
        features(database.prepare(kInsertFeatures)),
        factor(database.prepare("INSERT INTO factors VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)")),
        factor_status(database.prepare("UPDATE factors SET status = ? WHERE id = ?")),
        frame(database.prepare("INSERT INTO frames VALUES (?, ?, ?, ?, ?, ?)")),
        estimate(database.prepare("INSERT OR REPLACE INTO estimates VALUES (?, ?)")),
        final_estimate(database.prepare("INSERT OR REPLACE INTO final_estimates VALUES (?, ?, ?)")),
        checkpoint(database.prepare("INSERT OR REPLACE INTO checkpoint VALUES (0, ?, ?)")) {}

  void add(const StoredKeyframe& k);
  void add(std::size_t id, const StoredFactor& f);
  void add(const StoredFrame& f);
  void add_estimate(std::size_t keyframe_index, const Pose& T_map_body);
  void add(const StoredEstimate& e);
};

void Inserts::add(const StoredKeyframe& k) {
  const std::string first = blob_of(k.T_map_body), odometry = blob_of(k.T_map_body_odometry);
  keyframe.bind(1, k.index).bind(2, k.frame).bind(3, k.t_ns);
  keyframe.bind_blob(4, first).bind_blob(5, odometry).bind_blob(6, k.payload).run();
}

void Inserts::add(std::size_t id, const StoredFactor& f) {
  const std::string kind = to_text(f.kind), pose = blob_of(f.measurement.T_i_j),
                    sigma = blob_of(f.measurement.covariance);
  factor.bind(1, id).bind_text(2, kind).bind(3, f.measurement.i).bind(4, f.measurement.j);
  factor.bind_blob(5, pose).bind_blob(6, sigma).bind_text(7, f.status).bind(8, f.chi_square).bind(9, f.inliers).run();
}

void Inserts::add(const StoredFrame& f) {
  const std::string pose = blob_of(f.T_keyframe_body);
  frame.bind(1, f.index).bind(2, f.t_ns).bind_text(3, f.status).bind(4, f.keyframe);
  frame.bind_blob(5, pose).bind_text(6, f.record).run();
}

void Inserts::add_estimate(std::size_t keyframe_index, const Pose& T_map_body) {
  const std::string pose = blob_of(T_map_body);
  estimate.bind(1, keyframe_index).bind_blob(2, pose).run();
}

void Inserts::add(const StoredEstimate& e) {
  const std::string pose = blob_of(e.T_map_body), covariance = e.covariance ? blob_of(*e.covariance) : std::string();
  final_estimate.bind(1, e.keyframe).bind_blob(2, pose);
  e.covariance ? final_estimate.bind_blob(3, covariance) : final_estimate.bind_null(3);
  final_estimate.run();
}

StoredKeyframe keyframe_of(const Statement& row) {
  return {row.index(0), row.index(1), row.integer(2), pose_of(row.bytes(3)), pose_of(row.bytes(4)), row.string(5)};
}

StoredFactor factor_of(const Statement& row) {
  return {.kind = kind_of(row.bytes(0)),
          .measurement = {row.index(1), row.index(2), pose_of(row.bytes(3)), matrix_of(row.bytes(4))},
          .status = row.string(5),
          .chi_square = row.real(6),
          .inliers = static_cast<int>(row.integer(7))};
}

StoredFrame frame_of(const Statement& row) {
  return {row.index(0), row.integer(1), row.string(2), row.index(3), pose_of(row.bytes(4)), row.string(5)};
}

StoredEstimate estimate_of(const Statement& row) {
  StoredEstimate estimate{row.index(0), pose_of(row.bytes(1)), std::nullopt};
  if (!row.is_null(2)) estimate.covariance = matrix_of(row.bytes(2));
  return estimate;
}

}  // namespace

struct MapStore::State {
  std::optional<WriterLock> lock;  // first in, last out
  Database database;
  MapStoreOptions options;
  Inserts inserts;
  Statement select_features, select_keyframe;
  std::size_t keyframes, factors;

  State(std::optional<WriterLock> held, const std::filesystem::path& file, OpenMode mode, const MapStoreOptions& o)
      : lock(std::move(held)),
        database(open_map_file(file, mode)),
        options(o),
        inserts(database),
        select_features(database.prepare(kSelectFeatures)),
        select_keyframe(database.prepare("SELECT * FROM keyframes WHERE id = ?")),
        keyframes(count("SELECT count(*) FROM keyframes")),
        factors(count("SELECT count(*) FROM factors")) {
    if (mode == OpenMode::write) database.execute(kWriterSettings);
    database.checkpoint_on_close(mode == OpenMode::write);
  }

  std::size_t count(const char* sql) { return static_cast<std::size_t>(database.integer(sql)); }

  void insert(const KeyframeEntry& entry);

  template <class Row>
  std::vector<Row> select(const char* sql, Row (*read)(const Statement&)) {
    std::vector<Row> rows;
    for (Statement statement = database.prepare(sql); statement.step();) rows.push_back(read(statement));
    return rows;
  }
};

void MapStore::State::insert(const KeyframeEntry& entry) {
  const std::size_t index = entry.keyframe.index;
  inserts.add(entry.keyframe);
  insert_features(inserts.features, index, *entry.features, options.descriptors);
  for (std::size_t i = 0; i < entry.factors.size(); ++i) inserts.add(factors + i, entry.factors[i]);
  for (const auto& [factor, status] : entry.factor_statuses) {
    inserts.factor_status.bind_text(1, status).bind(2, factor).run();
  }
  for (const StoredFrame& frame : entry.frames) inserts.add(frame);
  inserts.add_estimate(index, entry.keyframe.T_map_body);
  for (const auto& [keyframe, T_map_body] : entry.T_map_body) inserts.add_estimate(keyframe, T_map_body);
  inserts.checkpoint.bind(1, index).bind_blob(2, entry.checkpoint).run();
}

MapStore MapStore::create(const std::filesystem::path& file, const MapHeader& header, const MapStoreOptions& options) {
  WriterLock lock(file);
  create_map_file(file, header);
  return MapStore(std::make_unique<State>(std::move(lock), file, OpenMode::write, options));
}

MapStore MapStore::open(const std::filesystem::path& file, const MapStoreOptions& options) {
  return MapStore(std::make_unique<State>(WriterLock(file), file, OpenMode::write, options));
}

MapStore MapStore::open_read_only(const std::filesystem::path& file) {
  return MapStore(std::make_unique<State>(std::nullopt, file, OpenMode::read, MapStoreOptions{}));
}

MapStore::MapStore(std::unique_ptr<State> state) : state_(std::move(state)) {}
MapStore::MapStore(MapStore&&) noexcept = default;
MapStore& MapStore::operator=(MapStore&&) noexcept = default;

MapStore::~MapStore() {
  if (!state_ || !state_->lock) return;
  try {  // a closed map is one plain file, which also opens where nothing can be written beside it
    state_->database.execute("PRAGMA journal_mode = DELETE");
  } catch (const Error&) {  // somebody reads it: it stays in write-ahead mode, as complete
  }
}

void MapStore::append(const KeyframeEntry& entry) {
  State& s = *state_;
  assert(entry.features && entry.keyframe.index == s.keyframes);
  Transaction transaction(s.database);
  s.insert(entry);
  transaction.commit();
  ++s.keyframes;
  s.factors += entry.factors.size();
}

void MapStore::append_frames(const std::vector<StoredFrame>& frames) {
  Transaction transaction(state_->database);
  for (const StoredFrame& frame : frames) state_->inserts.add(frame);
  transaction.commit();
}

void MapStore::set_final_estimates(const std::vector<StoredEstimate>& estimates) {
  Transaction transaction(state_->database);
  for (const StoredEstimate& estimate : estimates) state_->inserts.add(estimate);
  transaction.commit();
}

void MapStore::rewind() {
  Transaction transaction(state_->database);
  state_->database.execute("DELETE FROM frames WHERE id > (SELECT coalesce(max(frame), -1) FROM keyframes)");
  state_->database.execute("DELETE FROM final_estimates");
  transaction.commit();
}

MapHeader MapStore::header() const {
  Statement select = state_->database.prepare("SELECT value FROM meta WHERE key = ?");
  const auto get = [&](const char* key) {
    return select.bind_text(1, key).first([](const Statement& row) { return row.string(0); }).value_or("");
  };
  return {rig_of(get("rig")), get("config_toml"), get("inputs"), get("version")};
}

std::size_t MapStore::keyframe_count() const { return state_->keyframes; }

StoredKeyframe MapStore::keyframe(std::size_t index) const {
  const auto keyframe = state_->select_keyframe.bind(1, index).first(keyframe_of);
  if (!keyframe) throw Error("the map has no keyframe " + std::to_string(index));
  return *keyframe;
}

std::vector<StoredKeyframe> MapStore::keyframes() const {
  return state_->select<StoredKeyframe>("SELECT * FROM keyframes ORDER BY id", keyframe_of);
}

std::shared_ptr<const StereoFeatures> MapStore::features(std::size_t keyframe) const {
  const auto features = state_->select_features.bind(1, keyframe).first(features_of);
  if (!features) throw Error("the map has no features of keyframe " + std::to_string(keyframe));
  return *features;
}

std::vector<StoredFactor> MapStore::factors() const {
  return state_->select<StoredFactor>(
      "SELECT kind, i, j, T_i_j, covariance, status, chi_square, inliers FROM factors ORDER BY id", factor_of);
}

std::vector<StoredEstimate> MapStore::estimates() const {
  return state_->select<StoredEstimate>(
      "SELECT e.keyframe, coalesce(f.T_map_body, e.T_map_body), f.covariance FROM estimates e "
      "LEFT JOIN final_estimates f USING (keyframe) ORDER BY e.keyframe",
      estimate_of);
}

void MapStore::for_each_frame(const std::function<void(const StoredFrame&)>& visit) const {
  for (Statement select = state_->database.prepare("SELECT * FROM frames ORDER BY id"); select.step();) {
    visit(frame_of(select));
  }
}

std::string MapStore::checkpoint() const { return state_->database.string("SELECT state FROM checkpoint"); }

}  // namespace demslam
