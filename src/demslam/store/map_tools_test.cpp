#include <gmock/gmock.h>

#include <cstring>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/dataset/test_folder.h"
#include "demslam/store/map_check.h"
#include "demslam/store/map_export.h"
#include "demslam/store/map_info.h"
#include "demslam/store/sqlite.h"
#include "demslam/store/test_map.h"

namespace demslam {
namespace {

using test::entry;
using test::make_map;
using test::small_header;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::size_t kLandmarksPerKeyframe = 13;  // of 20 features

void tamper(const std::filesystem::path& map, const std::string& sql) { Database(map, OpenMode::write).execute(sql); }

TEST(MapInfo, CountsWhatIsThere) {
  const test::TestFolder folder;
  const auto file = folder.path() / "map.db";
  {
    MapStore store = MapStore::create(file, small_header());
    store.append(entry(0));
    KeyframeEntry closing = entry(1);
    closing.factors.push_back({FactorKind::loop, {0, 1}, "accepted"});
    closing.factors.push_back({FactorKind::loop, {0, 1}, "inconsistent"});
    store.append(closing);
    const Pose origin, end(Eigen::Quaterniond::Identity(), {0.0, 3.0, 4.0});
    store.set_final_estimates({{0, origin, {}}, {1, end, {}}});
  }
  const MapInfo info = map_info(file);
  EXPECT_EQ(info.schema, kMapSchema);
  EXPECT_EQ(info.version, kVersion);
  EXPECT_EQ(info.keyframes, 2U);
  EXPECT_EQ(info.frames, 4U);
  EXPECT_EQ(info.odometry_factors, 1U);
  EXPECT_EQ(info.loops, 2U);
  EXPECT_EQ(info.loops_accepted, 1U);
  EXPECT_EQ(info.features, 40U);
  EXPECT_EQ(info.landmarks, 2 * kLandmarksPerKeyframe);
  EXPECT_EQ(info.descriptor_width, 16);
  EXPECT_DOUBLE_EQ(info.length_m, 5.0);
  EXPECT_DOUBLE_EQ(info.duration_s, 0.3);
  EXPECT_EQ(info.file_bytes, static_cast<std::int64_t>(std::filesystem::file_size(file)));
  EXPECT_DOUBLE_EQ(info.bytes_per_km(), static_cast<double>(info.file_bytes) * 200.0);
}

TEST(MapInfo, OfAnEmptyMapIsZero) {
  const test::TestFolder folder;
  const MapInfo info = map_info(make_map(folder.path() / "map.db", 0));
  EXPECT_EQ(info.keyframes, 0U);
  EXPECT_EQ(info.bytes_per_km(), 0.0);
}

TEST(MapCheck, FindsNothingInASoundMap) {
  const test::TestFolder folder;
  const MapReport report = check_map(make_map(folder.path() / "map.db", 5));
  EXPECT_THAT(report.problems, IsEmpty());
  EXPECT_EQ(report.keyframes, 5U);
  EXPECT_EQ(report.factors, 4U);
  EXPECT_EQ(report.frames, 13U);
  EXPECT_THAT(check_map(make_map(folder.path() / "empty.db", 0)).problems, IsEmpty());
}

struct Tampering {
  const char *sql, *problem;
};

class TamperedMap : public testing::TestWithParam<Tampering> {};

TEST_P(TamperedMap, IsFoundOut) {
  const test::TestFolder folder;
  const auto file = make_map(folder.path() / "map.db", 4);
  tamper(file, GetParam().sql);
  EXPECT_THAT(check_map(file).problems, Contains(HasSubstr(GetParam().problem)));
}

INSTANTIATE_TEST_SUITE_P(
    Each, TamperedMap,
    testing::Values(Tampering{"DELETE FROM features WHERE keyframe = 2", "no features of keyframe 2"},
                    Tampering{"UPDATE features SET count = 19 WHERE keyframe = 2", "keyframe 2 are damaged"},
                    Tampering{"UPDATE features SET keypoints = x'00' WHERE keyframe = 1", "features of keyframe 1"},
                    Tampering{"DELETE FROM factors WHERE j = 3", "keyframe 3: has no odometry"},
                    Tampering{"UPDATE factors SET i = 9 WHERE id = 0", "refers to nothing in keyframes"},
                    Tampering{"UPDATE factors SET covariance = zeroblob(7)", "has 7 bytes"},
                    Tampering{"DELETE FROM frames WHERE id = 6", "keyframe 2: has lost its frame"},
                    Tampering{"DELETE FROM estimates WHERE keyframe = 1", "3 of 4 keyframes"},
                    Tampering{"UPDATE estimates SET T_map_body = zeroblob(56)", "estimate 0: is broken"},
                    Tampering{"UPDATE keyframes SET frame = 0 WHERE id = 2", "keyframe 2: is out of order"},
                    Tampering{"UPDATE checkpoint SET keyframe = 1", "is of keyframe 1"}));

TEST(MapExport, WritesTheTrackAsTum) {
  const test::TestFolder folder;
  const auto files = export_map(make_map(folder.path() / "map.db", 3), folder.path() / "out");
  ASSERT_EQ(files.size(), 3U);
  const TextTable track = read_table(files[0]);
  ASSERT_EQ(track.rows.size(), 3U);
  const Pose expected = entry(2).keyframe.T_map_body;
  EXPECT_EQ(track.rows[2].fields[0], "0.600000000");
  EXPECT_NEAR(track.number(track.rows[2], 1), 2.0, 1e-9);
  EXPECT_NEAR(track.number(track.rows[2], 2), expected.translation().y(), 1e-9);
  EXPECT_NEAR(track.number(track.rows[2], 7), expected.rotation().w(), 1e-11);
}

TEST(MapExport, WritesFactorsAsCsv) {
  const test::TestFolder folder;
  const auto files = export_map(make_map(folder.path() / "map.db", 3), folder.path() / "out");
  const TextTable factors = read_table(files[1]);
  ASSERT_EQ(factors.rows.size(), 3U);
  const TextRow& header = factors.rows[0];
  const TextRow& last = factors.rows[2];
  ASSERT_EQ(header.fields.size(), last.fields.size());
  EXPECT_EQ(last.fields[0], "odometry");
  EXPECT_EQ(factors.integer(last, 1), 1);
  EXPECT_EQ(factors.integer(last, 2), 2);
  EXPECT_EQ(header.fields[13], "c00");
  EXPECT_DOUBLE_EQ(factors.number(last, 13), 1e-4);
}

TEST(MapExport, PutsLandmarksWhereTheCameraSawThem) {
  const test::TestFolder folder;
  const auto file = folder.path() / "map.db";
  const RectifiedRig rig = small_header().rig;
  const Eigen::Vector3d p_left(0.5, 0.2, 4.0);
  KeyframeEntry seen = entry(0, 2);
  auto features = test::random_features(0, 2);
  features->left.keypoints[1] = rig.project(p_left).cast<float>();
  features->disparity_px = {0.0F, static_cast<float>(rig.disparity_px(p_left.z()))};
  seen.features = features;
  {
    MapStore::create(file, small_header()).append(seen);
  }
  const std::string ply = read_text(export_map(file, folder.path() / "out")[2]);
  EXPECT_THAT(ply, HasSubstr("element vertex 1\n"));
  const std::size_t begin = ply.find("end_header\n") + 11;
  ASSERT_EQ(ply.size() - begin, 12U);
  Eigen::Vector3f p_map;
  std::memcpy(p_map.data(), ply.data() + begin, 12);
  const Eigen::Vector3d expected = seen.keyframe.T_map_body * (rig.T_body_left * p_left);
  EXPECT_LT((p_map.cast<double>() - expected).norm(), 1e-4);
}

TEST(MapExport, SaysWhenItCannotWrite) {
  const test::TestFolder folder;
  const auto map = make_map(folder.path() / "map.db", 1);
  const auto blocked = folder.text("blocked", "a file");
  EXPECT_THROW(export_map(map, blocked), Error);
}

}  // namespace
}  // namespace demslam
