#include "demslam/sim/simulate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

#include "demslam/base/error.h"
#include "demslam/dataset/sequence.h"
#include "demslam/sim/dataset_writer.h"
#include "demslam/sim/dem_product.h"
#include "demslam/sim/rover.h"
#include "demslam/sim/sensor.h"
#include "demslam/sim/test_scenes.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

SceneOptions small_scene() {
  SceneOptions scene;
  scene.terrain.size_m = 120.0;
  scene.camera.width_px = scene.camera.height_px = 96;
  scene.rover.length_m = 2.0;
  scene.rover.start_m = {-5.0, 3.0};
  return scene;
}

fs::path empty_folder(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / name;
  fs::remove_all(folder);
  return folder;
}

std::map<std::string, std::string> bytes_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ostringstream text;
    text << std::ifstream(entry.path(), std::ios::binary).rdbuf();
    files[fs::relative(entry.path(), folder).string()] = text.str();
  }
  return files;
}

std::string error_of(const SceneOptions& scene, const fs::path& out) {
  try {
    simulate(scene, out);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Simulate, WritesADatasetThatReadsBack) {
  const fs::path out = empty_folder("simulate_reads");
  const SceneOptions scene = small_scene();
  const SimulationReport report = simulate(scene, out);
  EXPECT_EQ(report.frames, 5U);
  EXPECT_EQ(report.rendered, 5U);
  const auto dataset = open_dataset(out);
  EXPECT_EQ(dataset->format(), "demslam");
  ASSERT_EQ(dataset->size(), 5U);
  EXPECT_NEAR(dataset->rig().T_left_right.translation().x(), scene.camera.baseline_m, 1e-12);
  ASSERT_TRUE(dataset->dem_file().has_value());
  const Dem dem(read_dem(*dataset->dem_file()));
  const Pose start = dataset->start().value().T_map_body;
  EXPECT_NEAR(dem.height(start.translation().x(), start.translation().y()).value(), start.translation().z(), 3.0);
  EXPECT_FALSE(fs::exists(out / ".unfinished"));
}

TEST(Simulate, StartsFromWhereTheMissionBelievesToBe) {
  const fs::path out = empty_folder("simulate_start");
  SceneOptions scene = small_scene();
  scene.start.error_m = {1.0, -2.0, 0.5};
  simulate(scene, out);
  const Terrain terrain(scene.terrain, scene.seed);
  const Pose truth = standing_pose(terrain, scene.rover, scene.rover.start_m, 0.0);
  const Pose believed = open_dataset(out)->start().value().T_map_body;
  EXPECT_LT((believed.translation() - truth.translation() - scene.start.error_m).norm(), 1e-6);
}

TEST(Simulate, GivesTheSameBytesOnOneAndTwoThreads) {
  const fs::path one = empty_folder("simulate_one"), two = empty_folder("simulate_two");
  for (const auto& [folder, threads] : {std::pair{one, 1}, std::pair{two, 2}}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    simulate(small_scene(), folder);
  }
  EXPECT_TRUE(bytes_of(one) == bytes_of(two));
}

TEST(Simulate, GoesOnWhereItWasStopped) {
  const fs::path whole = empty_folder("simulate_whole"), halves = empty_folder("simulate_halves");
  simulate(small_scene(), whole);
  std::stop_source stop;
  Progress progress;
  progress.stop = stop.get_token();
  progress.report = [&](std::size_t done, std::size_t) { done == 2 ? stop.request_stop() : false; };
  const SimulationReport first = simulate(small_scene(), halves, progress);
  EXPECT_TRUE(first.stopped);
  EXPECT_EQ(first.rendered, 2U);
  fs::remove(halves / "image1/color/1500000000.png");  // as if killed inside a frame
  const SimulationReport second = simulate(small_scene(), halves);
  EXPECT_FALSE(second.stopped);
  EXPECT_TRUE(bytes_of(whole) == bytes_of(halves));
}

TEST(Simulate, RefusesAFolderOfAnotherScene) {
  const fs::path out = empty_folder("simulate_other");
  SceneOptions scene = small_scene();
  simulate(scene, out);
  scene.seed = 2;
  EXPECT_THAT(error_of(scene, out), testing::HasSubstr("another scene"));
}

TEST(Simulate, RefusesAFolderThatCannotBeMade) {
  const fs::path file = empty_folder("simulate_file");
  std::ofstream(file) << "not a folder";
  EXPECT_THAT(error_of(small_scene(), file / "out"), testing::HasSubstr("cannot be made"));
}

TEST(Simulate, SaysWhenTheDiskIsFull) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const fs::path out = empty_folder("simulate_full");
  const DatasetWriter writer(out, small_scene());
  fs::create_symlink("/dev/full", out / ".unfinished/note.txt");
  EXPECT_THROW(writer.write_text("note.txt", std::string(1 << 20, 'x')), Error);
}

TEST(GroundTruth, HasLusnarsColumns) {
  const std::string text =
      ground_truth_text({{5, Pose(Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), Eigen::Vector3d(1.0, 2.0, 3.0))}});
  const std::string row = text.substr(text.find('\n') + 1);
  EXPECT_EQ(std::count(row.begin(), row.end(), ','), 16);
  EXPECT_THAT(row, testing::StartsWith(
                       "5,1.000000000,2.000000000,3.000000000,0.500000000000,0.500000000000,-0.500000000000,0.5"));
}

TEST(Pfm, HasItsBottomRowFirst) {
  const std::string bytes = pfm_bytes({1.0F, 2.0F, 3.0F, INFINITY}, 2, 2);
  ASSERT_EQ(bytes.size(), std::string("Pf\n2 2\n-1.0\n").size() + 16);
  float first[2];
  std::memcpy(first, bytes.data() + bytes.size() - 16, sizeof first);
  EXPECT_EQ(first[0], 3.0F);
  EXPECT_EQ(first[1], 65504.0F);  // sky
}

TEST(DemProduct, AveragesThePlaneExactly) {
  const Eigen::Vector2d slope(0.05, -0.1);
  const Terrain terrain(smooth_ground(), 1, plane_raster(7.0, slope));
  const DemRaster product = averaged_ground(terrain, {{0, Pose()}}, DemProductOptions{.margin_m = 60.0});
  EXPECT_EQ(product.rows, 24);
  for (int row = 0; row < product.rows; ++row) {
    EXPECT_NEAR(product.at(row, 5), 7.0 + slope.dot(product.centre(row, 5)), 1e-4);
  }
}

TEST(DemProduct, KeepsTheHolesOfItsSource) {
  DemRaster raster = plane_raster(0.0, {0.0, 0.0}, 60, 5.0);
  raster.at(30, 30) = std::nanf("");
  const Terrain terrain(smooth_ground(), 1, raster);
  const DemRaster product = averaged_ground(terrain, {{0, Pose()}}, DemProductOptions{.margin_m = 100.0});
  int holes = 0;
  for (const float height : product.heights) holes += !std::isfinite(height);
  EXPECT_EQ(holes, 1);
}

TEST(DemProduct, DegradesAsAsked) {
  const Terrain terrain(smooth_ground(), 1, plane_raster(7.0, {0.0, 0.0}, 800, 2.0));
  DemProductOptions options;
  options.margin_m = 700.0;
  options.noise_rms_m = 0.5;
  options.bias_m = 2.0;
  const DemRaster truth = averaged_ground(terrain, {{0, Pose()}}, options), product = degraded(truth, options, 3);
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < truth.heights.size(); ++i) {
    const double error = product.heights[i] - truth.heights[i];
    sum += error;
    squares += error * error;
  }
  const double count = static_cast<double>(truth.heights.size()), mean = sum / count;
  EXPECT_NEAR(mean, 2.0, 0.05);
  EXPECT_NEAR(std::sqrt(squares / count - mean * mean), 0.5, 0.03);
}

TEST(DemProduct, IsStraightBetweenAltimeterTracks) {
  TerrainOptions ground;
  ground.size_m = 400.0;
  const Terrain terrain(ground, 3);
  DemProductOptions options;
  options.noise_rms_m = 0.0;
  const DemRaster truth = averaged_ground(terrain, {{0, Pose()}}, options);
  options.track_spacing_m = 40.0;
  const DemRaster product = degraded(truth, options, 3);
  int exact = 0, straight = 0;
  for (int col = 1; col + 1 < truth.cols; ++col) {
    exact += product.at(9, col) == truth.at(9, col);
    straight += std::abs(product.at(9, col - 1) - 2.0F * product.at(9, col) + product.at(9, col + 1)) < 1e-4F;
  }
  EXPECT_NEAR(exact * 40.0 / 5.0, truth.cols, 30.0);  // a track each 8 cells
  EXPECT_GT(straight, truth.cols / 2);
}

Rendering grey_card(float radiance) {
  Rendering card;
  card.width = card.height = 64;
  card.radiance.assign(64 * 64, radiance);
  return card;
}

TEST(Sensor, ExposesTheBrightPartsBelowWhite) { EXPECT_NEAR(automatic_exposure(grey_card(0.1F)), 8.0, 1e-5); }

TEST(Sensor, NoiseIsThatOfTheElectronsAndIsRepeatable) {
  CameraOptions camera;
  camera.gamma = 1.0;
  camera.full_well_e = 1000.0;
  camera.read_noise_e = 20.0;
  camera.vignetting = 0.0;
  const Image image = develop(grey_card(0.05F), camera, 10.0, 99).upper_byte();
  double sum = 0.0, squares = 0.0;
  for (const auto pixel : image.pixels) sum += pixel, squares += pixel * pixel;
  const double mean = sum / 4096.0, sigma = std::sqrt(squares / 4096.0 - mean * mean);
  EXPECT_NEAR(mean, 127.5, 0.6);
  EXPECT_NEAR(sigma, 255.0 * std::sqrt(500.0 + 400.0) / 1000.0, 0.4);
  EXPECT_EQ(image.pixels, develop(grey_card(0.05F), camera, 10.0, 99).upper_byte().pixels);
  EXPECT_NE(image.pixels, develop(grey_card(0.05F), camera, 10.0, 100).upper_byte().pixels);
}

TEST(Sensor, BlurKeepsTheLight) {
  Rendering dot = grey_card(0.0F);
  dot.radiance[32 * 64 + 32] = 1.0F;
  CameraOptions camera;
  camera.full_well_e = 0.0;
  camera.gamma = 1.0;
  camera.blur_px = 1.0;
  camera.vignetting = 0.0;
  const Image image = develop(dot, camera, 1.0, 1).upper_byte();
  EXPECT_EQ(image.at(32, 32), std::lround(255.0 / (2.0 * 3.14159265)));
  EXPECT_EQ(image.at(33, 32), std::lround(255.0 / (2.0 * 3.14159265) * std::exp(-0.5)));
}

}  // namespace
}  // namespace demslam
