#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "demslam/base/time.h"
#include "demslam/dataset/compression.h"

namespace demslam {

/// Writes a ROS 1 bag, format 2.0. The file is whole once finish() has returned.
class BagWriter {
 public:
  /// Throws Error when the file cannot be written.
  BagWriter(const std::filesystem::path& file, Compression compression);
  ~BagWriter();

  /// Announces a topic. `definition` is the message's text with those it uses; `md5` its digest, as ROS computes them.
  std::uint32_t add_topic(const std::string& topic, const std::string& type, const std::string& md5,
                          const std::string& definition);
  /// A serialised message. ROS times are unsigned 32-bit seconds: 0 <= received_ns < 2^32 s.
  void write(std::uint32_t topic, TimestampNs received_ns, const std::vector<std::uint8_t>& message);
  /// Writes the index. Throws Error when the disk is full.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace demslam
