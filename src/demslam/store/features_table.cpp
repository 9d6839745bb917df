#include "demslam/store/features_table.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "demslam/base/error.h"
#include "demslam/store/blob.h"

namespace demslam {
namespace {

constexpr float kLargestByte = 127.0F;

enum Column {
  count = 1,
  width,
  with_depth,
  image_width,
  image_height,
  keypoints,
  scores,
  disparities,
  scales,
  descriptors
};

struct ByteRows {
  std::vector<float> scales;
  std::vector<std::int8_t> bytes;
};

ByteRows to_bytes(const DescriptorRows& rows) {
  ByteRows coded;
  coded.bytes.reserve(static_cast<std::size_t>(rows.size()));
  for (const auto& row : rows.rowwise()) {
    const float scale = row.size() > 0 ? row.cwiseAbs().maxCoeff() / kLargestByte : 0.0F;
    const float inverse = scale > 0.0F ? 1.0F / scale : 0.0F;
    coded.scales.push_back(scale);
    for (const float value : row) coded.bytes.push_back(static_cast<std::int8_t>(std::lrint(value * inverse)));
  }
  return coded;
}

void from_bytes(std::string_view scale_blob, std::string_view byte_blob, DescriptorRows& rows) {
  const auto scale = array_of<float>(scale_blob, static_cast<std::size_t>(rows.rows()));
  const auto bytes = array_of<std::int8_t>(byte_blob, static_cast<std::size_t>(rows.size()));
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    const std::int8_t* row = bytes.data() + r * rows.cols();
    for (Eigen::Index c = 0; c < rows.cols(); ++c)
      rows(r, c) = scale[static_cast<std::size_t>(r)] * static_cast<float>(row[c]);
  }
}

std::string_view keypoint_bytes(const Features& features) {
  static_assert(sizeof(Eigen::Vector2f) == 2 * sizeof(float));
  return bytes_of(std::span<const Eigen::Vector2f>(features.keypoints));
}

void bind_descriptors_and_run(Statement& insert, const DescriptorRows& rows, DescriptorCoding coding) {
  if (coding == DescriptorCoding::exact) {
    insert.bind_null(scales + 1);
    insert.bind_blob(descriptors + 1,
                     bytes_of(std::span<const float>(rows.data(), static_cast<std::size_t>(rows.size()))));
    insert.run();
  } else {
    const ByteRows coded = to_bytes(rows);
    insert.bind_blob(scales + 1, bytes_of(std::span<const float>(coded.scales)));
    insert.bind_blob(descriptors + 1, bytes_of(std::span<const std::int8_t>(coded.bytes)));
    insert.run();
  }
}

/// Sizes that a damaged row could claim, checked before memory is taken for them.
void check_sizes(const Statement& row) {
  const std::int64_t rows = row.integer(count), cols = row.integer(width);
  const std::int64_t bytes = static_cast<std::int64_t>(row.bytes(descriptors).size());
  const std::int64_t per_row = cols * (row.is_null(scales) ? 4 : 1);
  const bool fits =
      rows >= 0 && cols >= 0 && cols < (1 << 20) && (rows == 0 || per_row == 0 || bytes / per_row == rows);
  if (!fits || static_cast<std::int64_t>(row.bytes(scores).size()) / 4 != rows) {
    throw Error("features of keyframe " + row.string(0) +
                " are damaged; restore a copy, or remove the map and run again");
  }
}

}  // namespace

void insert_features(Statement& insert, std::size_t keyframe, const StereoFeatures& features, DescriptorCoding coding) {
  const Features& left = features.left;
  assert(left.scores.size() == left.size() && features.disparity_px.size() == left.size());
  assert(static_cast<std::size_t>(left.descriptors.rows()) == left.size());
  const auto depths = std::ranges::count_if(features.disparity_px, [](float d) { return d > 0.0F; });
  insert.bind(1, keyframe)
      .bind(count + 1, left.size())
      .bind(width + 1, static_cast<std::int64_t>(left.descriptors.cols()))
      .bind(with_depth + 1, static_cast<std::int64_t>(depths))
      .bind(image_width + 1, left.image_width)
      .bind(image_height + 1, left.image_height)
      .bind_blob(keypoints + 1, keypoint_bytes(left))
      .bind_blob(scores + 1, bytes_of(std::span<const float>(left.scores)))
      .bind_blob(disparities + 1, bytes_of(std::span<const float>(features.disparity_px)));
  bind_descriptors_and_run(insert, left.descriptors, coding);
}

std::shared_ptr<const StereoFeatures> features_of(const Statement& row) {
  check_sizes(row);
  auto features = std::make_shared<StereoFeatures>();
  Features& left = features->left;
  const std::size_t size = row.index(count);
  left.image_width = static_cast<int>(row.integer(image_width));
  left.image_height = static_cast<int>(row.integer(image_height));
  left.keypoints = array_of<Eigen::Vector2f>(row.bytes(keypoints), size);
  left.scores = array_of<float>(row.bytes(scores), size);
  features->disparity_px = array_of<float>(row.bytes(disparities), size);
  left.descriptors.resize(static_cast<Eigen::Index>(size), row.integer(width));
  if (row.is_null(scales)) {
    const std::span<float> values(left.descriptors.data(), static_cast<std::size_t>(left.descriptors.size()));
    read_bytes(row.bytes(descriptors), std::as_writable_bytes(values));
  } else {
    from_bytes(row.bytes(scales), row.bytes(descriptors), left.descriptors);
  }
  return features;
}

}  // namespace demslam
