#include "demslam/dataset/ros_messages.h"

#include <algorithm>
#include <map>

#include "demslam/dataset/bytes.h"
#include "demslam/dataset/rosbag_format.h"

namespace demslam {
namespace {

const std::string kRule(80, '=');
const std::string kHeaderDefinition = kRule + "\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

/// How the bytes of one pixel become grey.
struct Encoding {
  int bytes_per_pixel;
  int red, green, blue;  ///< offsets of the channels; -1: no colour
};

const std::map<std::string, Encoding, std::less<>> kEncodings = {
    {"mono8", {1, -1, -1, -1}}, {"8UC1", {1, -1, -1, -1}}, {"mono16", {2, -1, -1, -1}}, {"16UC1", {2, -1, -1, -1}},
    {"rgb8", {3, 0, 1, 2}},     {"bgr8", {3, 2, 1, 0}},    {"rgba8", {4, 0, 1, 2}},     {"bgra8", {4, 2, 1, 0}},
};

const Encoding& encoding_named(const std::string& name, const std::string& source) {
  const auto found = kEncodings.find(name);
  if (found != kEncodings.end()) return found->second;
  std::string known;
  for (const auto& [key, encoding] : kEncodings) known += (known.empty() ? "" : ", ") + key;
  throw Error(source + ": unknown image encoding '" + name + "'; known are " + known);
}

/// Rec. 601 luma in 14-bit fixed point, rounded, as OpenCV has it.
std::uint8_t luma(int red, int green, int blue) {
  return static_cast<std::uint8_t>((4899 * red + 9617 * green + 1868 * blue + 8192) >> 14);
}

std::uint8_t grey_of(const std::uint8_t* pixel, const Encoding& encoding, bool big_endian) {
  if (encoding.red >= 0) return luma(pixel[encoding.red], pixel[encoding.green], pixel[encoding.blue]);
  return pixel[encoding.bytes_per_pixel == 2 && !big_endian ? 1 : 0];
}

void skip_header(ByteReader& reader) {
  reader.take(kRosStampBytes);
  reader.block();
}

void write_header(ByteWriter& writer, TimestampNs t_ns, const std::string& frame_id) {
  writer.number(std::uint32_t{0});
  write_ros_time(writer, t_ns);
  writer.text(frame_id);
}

template <std::size_t N>
std::array<double, N> read_array(ByteReader& reader) {
  std::array<double, N> values;
  for (double& value : values) value = reader.number<double>();
  return values;
}

}  // namespace

const RosType& ros_image_type() {
  static const RosType type{"sensor_msgs/Image", "060021388200f6f0f447d0fcd9c64743",
                            "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n"
                            "uint32 step\nuint8[] data\n" +
                                kHeaderDefinition};
  return type;
}

const RosType& ros_camera_info_type() {
  static const RosType type{
      "sensor_msgs/CameraInfo", "c9a58c1b0b154e0e6da7578cb991d214",
      "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] D\nfloat64[9] K\n"
      "float64[9] R\nfloat64[12] P\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n" +
          kHeaderDefinition + kRule +
          "\nMSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\n"
          "bool do_rectify\n"};
  return type;
}

TimestampNs ros_header_stamp(ByteSpan message, const std::string& source) {
  ByteReader reader(message, source);
  reader.number<std::uint32_t>();  // seq
  return read_ros_time(reader);
}

Image decode_ros_image(ByteSpan message, const std::string& source) {
  ByteReader reader(message, source);
  skip_header(reader);
  const auto height = reader.number<std::uint32_t>(), width = reader.number<std::uint32_t>();
  const Encoding encoding = encoding_named(reader.text(), source);
  const bool big_endian = reader.number<std::uint8_t>() != 0;
  const std::size_t step = reader.number<std::uint32_t>();
  const ByteSpan data = reader.block();
  const std::size_t row_bytes = std::size_t{width} * static_cast<std::size_t>(encoding.bytes_per_pixel);
  if (width == 0 || height == 0 || step < row_bytes || data.size() < (std::size_t{height} - 1) * step + row_bytes) {
    throw Error(source + ": an image holds fewer bytes than its size needs; the bag is damaged");
  }
  Image image(static_cast<int>(width), static_cast<int>(height));
  auto out = image.pixels.begin();
  for (std::size_t v = 0; v < height; ++v) {
    const std::uint8_t* pixel = data.data() + v * step;
    for (std::size_t u = 0; u < width; ++u, pixel += encoding.bytes_per_pixel)
      *out++ = grey_of(pixel, encoding, big_endian);
  }
  return image;
}

Bytes encode_ros_image(const Image& image, TimestampNs t_ns, const std::string& frame_id) {
  ByteWriter writer;
  write_header(writer, t_ns, frame_id);
  const auto width = static_cast<std::uint32_t>(image.width);
  writer.number(static_cast<std::uint32_t>(image.height)).number(width).text("mono8");
  writer.number(std::uint8_t{0}).number(width).block(image.pixels);
  return writer.bytes();
}

Camera RosCameraInfo::rectified() const {
  return {.width = width, .height = height, .fx = P[0], .fy = P[5], .cx = P[2], .cy = P[6]};
}

RosCameraInfo decode_ros_camera_info(ByteSpan message, const std::string& source) {
  ByteReader reader(message, source);
  skip_header(reader);
  RosCameraInfo info;
  info.height = static_cast<int>(reader.number<std::uint32_t>());
  info.width = static_cast<int>(reader.number<std::uint32_t>());
  reader.block();                                                             // distortion model
  reader.take(std::size_t{reader.number<std::uint32_t>()} * sizeof(double));  // D
  info.K = read_array<9>(reader);
  read_array<9>(reader);  // R
  info.P = read_array<12>(reader);
  return info;
}

Bytes encode_ros_camera_info(const RectifiedRig& rig, double baseline_m, TimestampNs t_ns,
                             const std::string& frame_id) {
  const double f = rig.focal_px;
  ByteWriter writer;
  write_header(writer, t_ns, frame_id);
  writer.number(static_cast<std::uint32_t>(rig.height)).number(static_cast<std::uint32_t>(rig.width)).text("plumb_bob");
  writer.number(std::uint32_t{5});
  for (int i = 0; i < 5; ++i) writer.number(0.0);
  for (const double k : {f, 0.0, rig.cx, 0.0, f, rig.cy, 0.0, 0.0, 1.0}) writer.number(k);
  for (const double r : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) writer.number(r);
  for (const double p : {f, 0.0, rig.cx, -f * baseline_m, 0.0, f, rig.cy, 0.0, 0.0, 0.0, 1.0, 0.0}) writer.number(p);
  for (int i = 0; i < 6; ++i) writer.number(std::uint32_t{0});  // binning, region of interest
  writer.number(std::uint8_t{0});
  return writer.bytes();
}

}  // namespace demslam
