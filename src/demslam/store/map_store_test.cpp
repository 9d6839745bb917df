#include "demslam/store/map_store.h"

#include <gmock/gmock.h>

#include "demslam/base/error.h"
#include "demslam/dataset/test_folder.h"
#include "demslam/store/test_map.h"

namespace demslam {
namespace {

using test::entry;
using test::make_map;
using test::same_bits;
using test::small_header;
using testing::HasSubstr;
using testing::ThrowsMessage;

std::vector<StoredFrame> frames_of(const MapStore& store) {
  std::vector<StoredFrame> frames;
  store.for_each_frame([&](const StoredFrame& frame) { frames.push_back(frame); });
  return frames;
}

TEST(MapStore, KeepsItsHeader) {
  const test::TestFolder folder;
  const MapStore store = MapStore::open_read_only(make_map(folder.path() / "map.db", 0));
  const MapHeader header = store.header(), expected = small_header();
  EXPECT_EQ(header.config_toml, expected.config_toml);
  EXPECT_EQ(header.inputs, expected.inputs);
  EXPECT_EQ(header.version, kVersion);
  EXPECT_EQ(header.rig.width, 640);
  EXPECT_EQ(header.rig.focal_px, 400.1);
  EXPECT_EQ(header.rig.baseline_m, 0.3);
  EXPECT_TRUE(same_bits(header.rig.T_body_left, expected.rig.T_body_left));
  EXPECT_EQ(header.rig.p_body_ground, expected.rig.p_body_ground);
  EXPECT_EQ(store.keyframe_count(), 0U);
  EXPECT_EQ(store.checkpoint(), "");
}

TEST(MapStore, ReturnsKeyframesAndTheirFeaturesBitForBit) {
  const test::TestFolder folder;
  const MapStore store = MapStore::open_read_only(make_map(folder.path() / "map.db", 200));
  ASSERT_EQ(store.keyframes().size(), 200U);
  for (const StoredKeyframe& keyframe : store.keyframes()) {
    const KeyframeEntry expected = entry(keyframe.index);
    EXPECT_EQ(keyframe.frame, expected.keyframe.frame);
    EXPECT_EQ(keyframe.t_ns, expected.keyframe.t_ns);
    EXPECT_EQ(keyframe.payload, "anchor");
    EXPECT_TRUE(same_bits(keyframe.T_map_body, expected.keyframe.T_map_body));
    EXPECT_TRUE(same_bits(keyframe.T_map_body_odometry, expected.keyframe.T_map_body_odometry));
    EXPECT_TRUE(same_bits(*store.features(keyframe.index), *expected.features));
  }
  EXPECT_EQ(store.keyframe(7).t_ns, entry(7).keyframe.t_ns);
  EXPECT_EQ(store.checkpoint(), "state at 199");
}

TEST(MapStore, ReturnsFramesAndFactorsInOrder) {
  const test::TestFolder folder;
  const MapStore store = MapStore::open_read_only(make_map(folder.path() / "map.db", 4));
  const auto frames = frames_of(store);
  const auto factors = store.factors();
  ASSERT_EQ(frames.size(), 3 * test::kFramesPerKeyframe + 1);
  ASSERT_EQ(factors.size(), 3U);
  for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(frames[i].index, i);
  EXPECT_EQ(frames[4].keyframe, 1U);
  EXPECT_TRUE(same_bits(frames[4].T_keyframe_body, entry(2).frames[0].T_keyframe_body));
  EXPECT_EQ(frames[4].record, "{\"frame\":1}");
  const RelativePose& measurement = factors[2].measurement;
  EXPECT_EQ(measurement.i, 2U);
  EXPECT_EQ(measurement.j, 3U);
  EXPECT_TRUE(same_bits(measurement.T_i_j, entry(3).factors[0].measurement.T_i_j));
  EXPECT_EQ(measurement.covariance, entry(3).factors[0].measurement.covariance);
  EXPECT_EQ(factors[2].inliers, 80);
}

TEST(MapStore, KeepsLoopsAndChangesOfMindAboutThem) {
  const test::TestFolder folder;
  MapStore store = MapStore::create(folder.path() / "map.db", small_header());
  for (std::size_t k = 0; k < 3; ++k) store.append(entry(k));
  KeyframeEntry closing = entry(3);
  closing.factors.push_back({FactorKind::loop, {0, 3, Pose(), Matrix6d::Identity()}, "accepted", 4.5, 33});
  store.append(closing);
  KeyframeEntry next = entry(4);
  next.factor_statuses.push_back({3, "rejected later"});
  store.append(next);
  const auto factors = store.factors();
  ASSERT_EQ(factors.size(), 5U);
  EXPECT_EQ(factors[3].kind, FactorKind::loop);
  EXPECT_EQ(factors[3].status, "rejected later");
  EXPECT_EQ(factors[3].chi_square, 4.5);
  EXPECT_EQ(factors[4].kind, FactorKind::odometry);
  EXPECT_EQ(factors[4].status, "accepted");
}

TEST(MapStore, EstimatesFollowTheOptimisationsOfTheRunAndTheLastOne) {
  const test::TestFolder folder;
  MapStore store = MapStore::create(folder.path() / "map.db", small_header());
  store.append(entry(0));
  const Pose moved(Eigen::Quaterniond::Identity(), {1.0, 2.0, 3.0}),
      last(Eigen::Quaterniond::Identity(), {4.0, 5.0, 6.0});
  KeyframeEntry next = entry(1);
  next.T_map_body.emplace_back(0, moved);
  store.append(next);
  EXPECT_TRUE(same_bits(store.estimates()[0].T_map_body, moved));
  EXPECT_TRUE(same_bits(store.estimates()[1].T_map_body, next.keyframe.T_map_body));
  EXPECT_FALSE(store.estimates()[0].covariance);

  const Matrix6d covariance = Matrix6d::Random();
  store.set_final_estimates({{0, last, covariance}});
  EXPECT_TRUE(same_bits(store.estimates()[0].T_map_body, last));
  EXPECT_EQ(store.estimates()[0].covariance, covariance);
  store.rewind();
  EXPECT_TRUE(same_bits(store.estimates()[0].T_map_body, moved));
}

TEST(MapStore, RewindGoesBackToTheLastKeyframe) {
  const test::TestFolder folder;
  const auto file = make_map(folder.path() / "map.db", 2);
  {
    MapStore store = MapStore::open(file);
    store.append_frames({{4, 400'000'000, "tracked", 1, Pose(), ""}, {5, 500'000'000, "bridged", 1, Pose(), ""}});
    ASSERT_EQ(frames_of(store).size(), 6U);
  }
  MapStore store = MapStore::open(file);
  store.rewind();
  EXPECT_EQ(frames_of(store).size(), 4U);
  store.append(entry(2));
  EXPECT_EQ(frames_of(store).size(), 7U);
}

TEST(MapStore, IsExtendedWhereItEnded) {
  const test::TestFolder folder;
  const auto file = make_map(folder.path() / "map.db", 3);
  {
    MapStore store = MapStore::open(file);
    ASSERT_EQ(store.keyframe_count(), 3U);
    store.append(entry(3));
  }
  const MapStore store = MapStore::open_read_only(file);
  EXPECT_EQ(store.keyframe_count(), 4U);
  EXPECT_EQ(store.factors().size(), 3U);
  EXPECT_TRUE(same_bits(*store.features(3), *entry(3).features));
}

TEST(MapStore, ClosedIsOneFile) {
  const test::TestFolder folder;
  make_map(folder.path() / "map.db", 3);
  const auto files = std::filesystem::directory_iterator(folder.path());
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
}

TEST(MapStore, IsReadWhileItIsWritten) {
  const test::TestFolder folder;
  MapStore writer = MapStore::create(folder.path() / "map.db", small_header());
  writer.append(entry(0));
  const MapStore reader = MapStore::open_read_only(folder.path() / "map.db");
  writer.append(entry(1));
  EXPECT_TRUE(same_bits(*reader.features(1), *entry(1).features));
}

TEST(MapStore, BytesKeepDescriptorsWithinHalfAStepAndReadTheSameAgain) {
  const test::TestFolder folder;
  const auto file = folder.path() / "map.db";
  {
    MapStore::create(file, small_header(), {.descriptors = DescriptorCoding::bytes}).append(entry(0));
  }
  const MapStore store = MapStore::open_read_only(file);
  const auto exact = entry(0).features, stored = store.features(0);
  EXPECT_EQ(stored->left.keypoints, exact->left.keypoints);
  EXPECT_EQ(stored->disparity_px, exact->disparity_px);
  for (int r = 0; r < exact->left.descriptors.rows(); ++r) {
    const float step = exact->left.descriptors.row(r).cwiseAbs().maxCoeff() / 127.0F;
    const auto error = (stored->left.descriptors.row(r) - exact->left.descriptors.row(r)).eval();
    EXPECT_LE(error.cwiseAbs().maxCoeff(), 0.5001F * step);
  }
  EXPECT_TRUE(same_bits(*stored, *store.features(0)));
}

TEST(MapStore, KeepsAKeyframeWithoutFeatures) {
  const test::TestFolder folder;
  for (const DescriptorCoding coding : {DescriptorCoding::exact, DescriptorCoding::bytes}) {
    const auto file = folder.path() / std::to_string(static_cast<int>(coding));
    KeyframeEntry empty = entry(0);
    empty.features = std::make_shared<StereoFeatures>();
    MapStore store = MapStore::create(file, small_header(), {.descriptors = coding});
    store.append(empty);
    EXPECT_EQ(store.features(0)->left.size(), 0U);
  }
}

TEST(MapStore, NamesAKeyframeThatIsMissing) {
  const test::TestFolder folder;
  const MapStore store = MapStore::open_read_only(make_map(folder.path() / "map.db", 1));
  EXPECT_THAT([&] { store.features(5); }, ThrowsMessage<Error>(HasSubstr("keyframe 5")));
  EXPECT_THAT([&] { store.keyframe(6); }, ThrowsMessage<Error>(HasSubstr("keyframe 6")));
  EXPECT_TRUE(same_bits(*store.features(0), *entry(0).features));
}

}  // namespace
}  // namespace demslam
