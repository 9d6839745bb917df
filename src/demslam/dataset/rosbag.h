#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "demslam/base/time.h"

namespace demslam {

struct BagConnection {
  std::uint32_t id = 0;
  std::string topic, type;
};

/// Where a message lies in its bag.
struct BagMessage {
  TimestampNs received_ns = 0;  ///< when it was recorded; the message's own header may say another time
  std::size_t chunk = 0;
  std::uint32_t offset = 0;  ///< in the unpacked chunk
};

/// Random access to a ROS 1 bag, format 2.0, chunks plain, bz2 or lz4. Reads the index once and messages on demand;
/// plain chunks are read in place, packed ones are unpacked whole and the last few kept. May be used from several
/// threads. Throws Error when the file is no bag, truncated, without index, or damaged.
class Bag {
 public:
  explicit Bag(const std::filesystem::path& file);
  ~Bag();
  Bag(Bag&&) noexcept;

  const std::string& source() const;
  const std::vector<BagConnection>& connections() const;
  /// Messages of a topic in the order they were received.
  std::vector<BagMessage> messages(const std::string& topic) const;
  /// The serialised message, or its first `limit` bytes.
  std::vector<std::uint8_t> read(const BagMessage& message,
                                 std::size_t limit = std::numeric_limits<std::size_t>::max()) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace demslam
