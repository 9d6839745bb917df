#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "demslam/base/error.h"
#include "demslam/dataset/sequence.h"
#include "demslam/dataset/test_folder.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;
using test::TestFolder;
using testing::HasSubstr;
using testing::ThrowsMessage;

std::string sensor_yaml(double x_m, const std::string& model = "radial-tangential") {
  return "%YAML:1.0\n# sensor\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0, 0, " +
         std::to_string(x_m) +
         ",\n         0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nresolution: [8, 6]\nintrinsics: [4, 4, 3.5, 2.5]\n"
         "distortion_model: " +
         model + "\ndistortion_coefficients: [-0.1, 0.2, 0.3, 0.4]\n";
}

class EurocReader : public testing::Test {
 protected:
  void write_camera(const std::string& camera, double x_m, const std::vector<std::string>& stamps) const {
    std::string index = "#timestamp [ns],filename\r\n";
    for (const std::string& stamp : stamps) {
      index += stamp + "," + stamp + ".png\r\n";
      folder_.image("mav0/" + camera + "/data/" + stamp + ".png", 30);
    }
    folder_.text("mav0/" + camera + "/data.csv", index);
    folder_.text("mav0/" + camera + "/sensor.yaml", sensor_yaml(x_m));
  }
  TestFolder folder_;
};

TEST_F(EurocReader, PairsByEqualStampAndCountsTheRest) {
  write_camera("cam0", 0.1, {"1403715273262142976", "1403715273312143104", "1403715273362142976"});
  write_camera("cam1", 0.3, {"1403715273262142976", "1403715273362142976", "1403715273362142977"});
  const auto sequence = open_dataset(folder_.path());
  EXPECT_EQ(sequence->format(), "euroc");
  ASSERT_EQ(sequence->size(), 2U);
  EXPECT_EQ(sequence->unpaired(), 2U);
  EXPECT_EQ(sequence->stamp_ns(1), 1403715273362142976);
  EXPECT_EQ(sequence->frame(1).right.at(0, 0), 30);
  EXPECT_NEAR(sequence->rig().T_left_right.translation().x(), 0.2, 1e-12);
  EXPECT_NEAR(sequence->rig().T_body_left.translation().x(), 0.1, 1e-12);
  EXPECT_EQ(sequence->rig().right.distortion, Distortion::radtan);
  EXPECT_DOUBLE_EQ(sequence->rig().right.coefficients[3], 0.4);
}

TEST_F(EurocReader, UnsortedAndDuplicateStampsAreRefusedWithTheirLine) {
  write_camera("cam0", 0.1, {"1", "3", "3"});
  write_camera("cam1", 0.3, {"1", "3"});
  EXPECT_THAT([&] { open_dataset(folder_.path()); },
              ThrowsMessage<Error>(HasSubstr("cam0/data.csv:4: the stamps must increase")));
}

TEST_F(EurocReader, NoCommonStampIsAnEmptyDataset) {
  write_camera("cam0", 0.1, {"1", "3"});
  write_camera("cam1", 0.3, {"2", "4"});
  EXPECT_THAT([&] { open_dataset(folder_.path()); }, ThrowsMessage<Error>(HasSubstr("the dataset is empty")));
}

TEST_F(EurocReader, RefusesASensorFileThatCannotBeMeant) {
  write_camera("cam0", 0.1, {"1"});
  write_camera("cam1", 0.3, {"1"});
  const auto open = [&](const std::string& yaml) {
    return [this, yaml] {
      folder_.text("mav0/cam0/sensor.yaml", yaml);
      open_dataset(folder_.path());
    };
  };
  EXPECT_THAT(open(sensor_yaml(0.1, "fov")),
              ThrowsMessage<Error>(HasSubstr("sensor.yaml:11: unknown distortion model 'fov'")));
  EXPECT_THAT(open(sensor_yaml(0.3)), ThrowsMessage<Error>(HasSubstr("the baseline must be positive")));
  EXPECT_THAT(open("resolution: [8, 6]\n"),
              ThrowsMessage<Error>(HasSubstr("sensor.yaml:1: key 'intrinsics' is missing")));
  EXPECT_THAT(open("a: [1, 2\nb: 3\n"), ThrowsMessage<Error>(HasSubstr("sensor.yaml:")));
}

TEST_F(EurocReader, TumViHasAKalibrFileInstead) {
  write_camera("cam0", 0.1, {"1", "2"});
  write_camera("cam1", 0.3, {"1", "2"});
  for (const char* camera : {"cam0", "cam1"}) fs::remove(folder_.path() / "mav0" / camera / "sensor.yaml");
  const std::string camera =
      "  camera_model: pinhole\n  distortion_coeffs: [0.003, 0.0007, -0.002, 0.0002]\n  distortion_model: equidistant\n"
      "  intrinsics: [4, 4, 3.5, 2.5]\n  resolution: [8, 6]\n";
  folder_.text("dso/camchain.yaml",
               "cam0:\n  T_cam_imu: [[1, 0, 0, -0.5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n" + camera +
                   "cam1:\n  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n" + camera);
  const auto sequence = open_dataset(folder_.path());
  EXPECT_EQ(sequence->size(), 2U);
  EXPECT_EQ(sequence->rig().left.distortion, Distortion::equidistant);
  EXPECT_NEAR(sequence->rig().T_left_right.translation().x(), 0.1, 1e-12);
  EXPECT_NEAR(sequence->rig().T_body_left.translation().x(), 0.5, 1e-12);
}

TEST(EurocReaderOnRealData, OpensV101) {
  const fs::path data = fs::path(DEMSLAM_SHARED_DIR) / "data/euroc_v101_short";
  if (!fs::exists(data)) GTEST_SKIP() << data << " is not here";
  const auto sequence = open_dataset(data);
  ASSERT_EQ(sequence->size(), 60U);
  EXPECT_EQ(sequence->unpaired(), 0U);
  EXPECT_NEAR(sequence->rig().T_left_right.translation().norm(), 0.110, 1e-3);
  EXPECT_EQ(sequence->frame(59).left.width, 752);
}

}  // namespace
}  // namespace demslam
