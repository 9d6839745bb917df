#include "demslam/dataset/calibration_import.h"

#include <algorithm>

namespace demslam {
namespace {

Distortion distortion_of(const Yaml& yaml) {
  const std::string name = yaml.text();
  if (name == "radial-tangential" || name == "radtan" || name == "plumb_bob") return Distortion::radtan;
  if (name == "equidistant") return Distortion::equidistant;
  if (name == "none") return Distortion::none;
  yaml.fail("unknown distortion model '" + name + "'; known are radial-tangential (radtan), equidistant and none");
}

void set_coefficients(Camera& camera, const Yaml& yaml) {
  const std::vector<double> values = yaml.numbers();
  const std::size_t limit = camera.distortion == Distortion::equidistant ? 4 : 5;
  if (values.size() > limit) yaml.fail("at most " + std::to_string(limit) + " distortion coefficients are known");
  std::copy(values.begin(), values.end(), camera.coefficients.begin());
}

std::vector<double> list_of(const Yaml& yaml, std::size_t count) {
  std::vector<double> values = yaml.numbers();
  if (values.size() != count) yaml.fail("a list of " + std::to_string(count) + " numbers is expected here");
  return values;
}

// --- Kalibr ---

Calibration import_kalibr(const Yaml& yaml) {
  const Yaml left = yaml["cam0"], right = yaml["cam1"];
  for (const Yaml* camera : {&left, &right}) {
    const Yaml model = (*camera)["camera_model"];
    if (model.text() != "pinhole") model.fail("unknown camera model '" + model.text() + "'; only pinhole is known");
  }
  StereoRig rig{read_listed_camera(left, "distortion_coeffs"), read_listed_camera(right, "distortion_coeffs")};
  rig.T_left_right = right["T_cn_cnm1"].pose().inverse();
  rig.T_body_left = left.has("T_cam_imu") ? left["T_cam_imu"].pose().inverse() : level_T_body_left();
  return {rig, std::nullopt};
}

// --- ORB-SLAM and stella_vslam: single numbers, named "Camera.fx" or "fx" under "Camera" ---

/// Reads "SECTION.name" flat or nested.
class Section {
 public:
  Section(const Yaml& yaml, std::string name) : yaml_(yaml), name_(std::move(name)) {}

  bool has(const std::string& key) const {
    return yaml_.has(name_ + "." + key) || (yaml_.has(name_) && yaml_[name_].has(key));
  }
  Yaml operator[](const std::string& key) const {
    return yaml_.has(name_) ? yaml_[name_][key] : yaml_[name_ + "." + key];
  }
  double number(const std::string& key) const { return (*this)[key].number(); }
  double number_or(const std::string& key, double otherwise) const { return has(key) ? number(key) : otherwise; }

 private:
  const Yaml& yaml_;
  std::string name_;
};

Camera named_pinhole(const Section& section, int width, int height) {
  return {.width = width,
          .height = height,
          .fx = section.number("fx"),
          .fy = section.number("fy"),
          .cx = section.number("cx"),
          .cy = section.number("cy")};
}

void read_named_coefficients(const Section& section, Camera& camera) {
  using Names = std::vector<const char*>;
  const Names names = camera.distortion == Distortion::equidistant ? Names{"k1", "k2", "k3", "k4"}
                                                                   : Names{"k1", "k2", "p1", "p2", "k3"};
  for (std::size_t i = 0; i < names.size(); ++i) camera.coefficients[i] = section.number_or(names[i], 0.0);
}

std::optional<double> frame_rate(const Section& camera) {
  return camera.has("fps") ? std::optional(camera.number("fps")) : std::nullopt;
}

/// One camera of a pair given by what rectifies it: K, D, and R from its raw to its rectified axes.
struct RectifiedFrom {
  Camera camera;
  Eigen::Matrix3d R_rectified_raw;
};

RectifiedFrom rectified_from(const Yaml& K_yaml, const Yaml& D_yaml, const Yaml& R_yaml, Camera camera) {
  const std::vector<double> K = list_of(K_yaml, 9);
  const std::vector<double> R = list_of(R_yaml, 9);
  camera.fx = K[0], camera.fy = K[4], camera.cx = K[2], camera.cy = K[5];
  set_coefficients(camera, D_yaml);
  return {camera, Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R.data())};
}

/// The right camera's centre lies at +baseline on the x axis that both rectified cameras share.
StereoRig rig_of(const RectifiedFrom& left, const RectifiedFrom& right, double baseline_m) {
  const Eigen::Matrix3d R_left_rectified = left.R_rectified_raw.transpose();
  StereoRig rig{left.camera, right.camera};
  rig.T_left_right = Pose(R_left_rectified * right.R_rectified_raw, R_left_rectified.col(0) * baseline_m);
  rig.T_body_left = level_T_body_left();
  return rig;
}

Calibration import_orb_slam_old(const Yaml& yaml) {
  const Section camera(yaml, "Camera"), left(yaml, "LEFT"), right(yaml, "RIGHT");
  const double baseline_m = camera.number("bf") / camera.number("fx");
  const int width = static_cast<int>(camera.number("width")), height = static_cast<int>(camera.number("height"));
  const Camera ideal = named_pinhole(camera, width, height);
  if (!left.has("K")) {
    const StereoRig rig{ideal, ideal, Pose(Eigen::Quaterniond::Identity(), {baseline_m, 0.0, 0.0}),
                        level_T_body_left()};
    return {rig, frame_rate(camera)};
  }
  Camera raw = ideal;
  raw.distortion = Distortion::radtan;
  return {rig_of(rectified_from(left["K"], left["D"], left["R"], raw),
                 rectified_from(right["K"], right["D"], right["R"], raw), baseline_m),
          frame_rate(camera)};
}

Calibration import_orb_slam(const Yaml& yaml) {
  const Section common(yaml, "Camera"), first(yaml, "Camera1"), second(yaml, "Camera2"), stereo(yaml, "Stereo");
  const std::string type = common["type"].text();
  const int width = static_cast<int>(common.number("width")), height = static_cast<int>(common.number("height"));
  StereoRig rig;
  rig.left = rig.right = named_pinhole(first, width, height);
  if (type == "Rectified") {
    rig.T_left_right = Pose(Eigen::Quaterniond::Identity(), {stereo.number("b"), 0.0, 0.0});
  } else if (type == "PinHole" || type == "KannalaBrandt8") {
    rig.right = named_pinhole(second, width, height);
    rig.left.distortion = rig.right.distortion = type == "PinHole" ? Distortion::radtan : Distortion::equidistant;
    read_named_coefficients(first, rig.left);
    read_named_coefficients(second, rig.right);
    rig.T_left_right = stereo["T_c1_c2"].pose();
  } else {
    common["type"].fail("unknown Camera.type '" + type + "'; known are PinHole, KannalaBrandt8 and Rectified");
  }
  const Section imu(yaml, "IMU");
  rig.T_body_left = imu.has("T_b_c1") ? imu["T_b_c1"].pose() : level_T_body_left();
  return {rig, frame_rate(common)};
}

Calibration import_stella(const Yaml& yaml) {
  const Section camera(yaml, "Camera"), rectifier(yaml, "StereoRectifier");
  const int width = static_cast<int>(camera.number("cols")), height = static_cast<int>(camera.number("rows"));
  const double baseline_m = camera.number("focal_x_baseline") / camera.number("fx");
  const std::string model = camera["model"].text();
  if (model != "perspective" && model != "fisheye") {
    camera["model"].fail("unknown camera model '" + model + "'; known are perspective and fisheye");
  }
  Camera left = named_pinhole(camera, width, height);
  if (!rectifier.has("K_left")) {
    const StereoRig rig{left, left, Pose(Eigen::Quaterniond::Identity(), {baseline_m, 0.0, 0.0}), level_T_body_left()};
    return {rig, frame_rate(camera)};
  }
  const bool fisheye = rectifier.has("model") ? rectifier["model"].text() == "fisheye" : model == "fisheye";
  left.distortion = fisheye ? Distortion::equidistant : Distortion::radtan;
  return {rig_of(rectified_from(rectifier["K_left"], rectifier["D_left"], rectifier["R_left"], left),
                 rectified_from(rectifier["K_right"], rectifier["D_right"], rectifier["R_right"], left), baseline_m),
          frame_rate(camera)};
}

Calibration import_any(const Yaml& yaml) {
  if (yaml.has("cam0")) return import_kalibr(yaml);
  if (yaml.has("Camera1.fx")) return import_orb_slam(yaml);
  if (Section(yaml, "Camera").has("focal_x_baseline")) return import_stella(yaml);
  if (yaml.has("Camera.bf")) return import_orb_slam_old(yaml);
  yaml.fail("no stereo calibration that is known; known are Kalibr camchain, ORB-SLAM and stella_vslam");
}

}  // namespace

Camera read_listed_camera(const Yaml& yaml, const std::string& coefficients_key) {
  const std::vector<double> size = list_of(yaml["resolution"], 2), pinhole = list_of(yaml["intrinsics"], 4);
  Camera camera{static_cast<int>(size[0]),
                static_cast<int>(size[1]),
                pinhole[0],
                pinhole[1],
                pinhole[2],
                pinhole[3],
                distortion_of(yaml["distortion_model"])};
  set_coefficients(camera, yaml[coefficients_key]);
  return camera;
}

Calibration import_calibration(const std::filesystem::path& yaml_file) {
  Calibration calibration = import_any(Yaml::from_file(yaml_file));
  check_rig(calibration.rig, yaml_file.string());
  return calibration;
}

}  // namespace demslam
