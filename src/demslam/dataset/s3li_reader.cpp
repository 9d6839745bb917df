// Stereo in a ROS 1 bag, as S3LI has it: rectified image topics of a left and a right camera with their camera_info.
// Pairs by equal header stamp. The body is a level one at the left camera; the calibration in the bag says no more.
#include <algorithm>
#include <set>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/dataset/calibration.h"
#include "demslam/dataset/readers.h"
#include "demslam/dataset/ros_messages.h"
#include "demslam/dataset/rosbag.h"

namespace demslam {
namespace {

namespace fs = std::filesystem;

struct StereoTopics {
  std::string left, right;
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  return at == std::string::npos ? "" : text.replace(at, from.size(), to);
}

/// "/stereo/left/image_rect" -> "/stereo/left/camera_info"
std::string info_topic(const std::string& image_topic) {
  return image_topic.substr(0, image_topic.rfind('/') + 1) + "camera_info";
}

/// The image topics that differ in left and right alone; rectified ones before others, then by name.
StereoTopics find_topics(const Bag& bag) {
  std::set<std::string> images;
  std::string all;
  for (const BagConnection& connection : bag.connections()) {
    if (connection.type == "sensor_msgs/Image") images.insert(connection.topic);
    all += " " + connection.topic + " (" + connection.type + ")";
  }
  std::vector<StereoTopics> found;
  for (const std::string& left : images) {
    const std::string right = replaced(left, "left", "right");
    if (images.count(right) != 0) found.push_back({left, right});
  }
  const auto rectified = [](const StereoTopics& topics) { return topics.left.find("rect") != std::string::npos; };
  std::stable_partition(found.begin(), found.end(), rectified);
  if (found.empty())
    throw Error(bag.source() + ": has no pair of left and right sensor_msgs/Image topics; it has" + all);
  return found.front();
}

struct StampedMessage {
  TimestampNs t_ns = 0;
  BagMessage message;
};

/// Messages by their header's stamp.
std::vector<StampedMessage> stamped_messages(const Bag& bag, const std::string& topic) {
  std::vector<StampedMessage> stamped;
  for (const BagMessage& message : bag.messages(topic)) {
    stamped.push_back({ros_header_stamp(bag.read(message, kRosStampBytes), bag.source()), message});
  }
  std::stable_sort(stamped.begin(), stamped.end(),
                   [](const StampedMessage& a, const StampedMessage& b) { return a.t_ns < b.t_ns; });
  const auto twice =
      std::adjacent_find(stamped.begin(), stamped.end(),
                         [](const StampedMessage& a, const StampedMessage& b) { return a.t_ns == b.t_ns; });
  if (twice == stamped.end()) return stamped;
  throw Error(bag.source() + ": " + topic + " has two images with the stamp " + seconds_text(twice->t_ns) +
              " s; which one is meant cannot be known");
}

struct StereoMessages {
  TimestampNs t_ns = 0;
  BagMessage left, right;
};

std::vector<StereoMessages> pair_by_stamp(const std::vector<StampedMessage>& left,
                                          const std::vector<StampedMessage>& right) {
  std::vector<StereoMessages> pairs;
  auto partner = right.begin();
  for (const StampedMessage& image : left) {
    while (partner != right.end() && partner->t_ns < image.t_ns) ++partner;
    if (partner != right.end() && partner->t_ns == image.t_ns)
      pairs.push_back({image.t_ns, image.message, partner->message});
  }
  return pairs;
}

RosCameraInfo first_camera_info(const Bag& bag, const std::string& image_topic) {
  const std::string topic = info_topic(image_topic);
  const std::vector<BagMessage> messages = bag.messages(topic);
  if (messages.empty()) throw Error(bag.source() + ": " + topic + " has no message; pass --calibration FILE");
  return decode_ros_camera_info(bag.read(messages.front()), bag.source());
}

StereoRig rig_of(const Bag& bag, const StereoTopics& topics) {
  if (topics.left.find("rect") == std::string::npos) {
    throw Error(bag.source() + ": " + topics.left + " is not rectified; pass --calibration FILE with its distortion");
  }
  const RosCameraInfo left = first_camera_info(bag, topics.left), right = first_camera_info(bag, topics.right);
  StereoRig rig{left.rectified(), right.rectified()};
  const double baseline_m = right.P[0] > 0.0 ? -right.P[3] / right.P[0] : 0.0;
  rig.T_left_right = Pose(Eigen::Quaterniond::Identity(), {baseline_m, 0.0, 0.0});
  rig.T_body_left = level_T_body_left();
  check_rig(rig, bag.source() + ": camera_info");
  return rig;
}

class BagSequence : public StereoSequence {
 public:
  BagSequence(const fs::path& path, const fs::path& calibration) : bag_(path), topics_(find_topics(bag_)) {
    const auto left = stamped_messages(bag_, topics_.left), right = stamped_messages(bag_, topics_.right);
    pairs_ = pair_by_stamp(left, right);
    unpaired_ = left.size() + right.size() - 2 * pairs_.size();
    if (pairs_.empty())
      throw Error(bag_.source() + ": the dataset is empty, no left image has the stamp of a right one");
    rig_ = calibration.empty() ? rig_of(bag_, topics_) : read_calibration(calibration).rig;
    if (!calibration.empty()) definition_files_ = {calibration};
  }

  std::string format() const override { return "s3li"; }
  const StereoRig& rig() const override { return rig_; }
  std::size_t size() const override { return pairs_.size(); }
  TimestampNs stamp_ns(std::size_t index) const override { return pairs_.at(index).t_ns; }
  std::size_t unpaired() const override { return unpaired_; }
  std::vector<fs::path> definition_files() const override { return definition_files_; }
  StereoFrame frame(std::size_t index) const override {
    const StereoMessages& pair = pairs_.at(index);
    return {pair.t_ns, image(pair.left, topics_.left), image(pair.right, topics_.right)};
  }

 private:
  Image image(const BagMessage& message, const std::string& topic) const {
    Image image = decode_ros_image(bag_.read(message), bag_.source());
    if (image.width == rig_.left.width && image.height == rig_.left.height) return image;
    throw Error(bag_.source() + ": an image of " + topic + " is " + std::to_string(image.width) + "x" +
                std::to_string(image.height) + " but the calibration is for " + std::to_string(rig_.left.width) + "x" +
                std::to_string(rig_.left.height));
  }

  Bag bag_;
  StereoTopics topics_;
  std::vector<StereoMessages> pairs_;
  std::size_t unpaired_ = 0;
  StereoRig rig_;
  std::vector<fs::path> definition_files_;
};

bool recognises(const fs::path& path) { return fs::is_regular_file(path) && path.extension() == ".bag"; }

std::unique_ptr<StereoSequence> open(const fs::path& path, const fs::path& calibration) {
  return std::make_unique<BagSequence>(path, calibration);
}

}  // namespace

const DatasetReader kS3liReader = {"s3li", "a ROS 1 .bag with left and right image topics", recognises, open};

}  // namespace demslam
