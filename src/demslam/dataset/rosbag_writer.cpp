#include "demslam/dataset/rosbag_writer.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <map>

#include "demslam/base/error.h"
#include "demslam/dataset/bytes.h"
#include "demslam/dataset/rosbag_format.h"

namespace demslam {
namespace {

constexpr std::size_t kChunkBytes = 768 * 1024;   // rosbag's own default
constexpr std::size_t kHeaderRecordBytes = 4096;  // padded, so that it can be rewritten at the end
const std::string kMagic = "#ROSBAG V2.0\n";

/// Fields of a record's head.
class Head {
 public:
  explicit Head(RecordKind kind) { number("op", static_cast<std::uint8_t>(kind)); }
  Head() = default;

  template <class Number>
  Head& number(const std::string& name, Number value) {
    ByteWriter bytes;
    bytes.number(value);
    return field(name, bytes.bytes());
  }
  Head& text(const std::string& name, const std::string& value) { return field(name, ByteWriter::as_bytes(value)); }
  Head& time(const std::string& name, TimestampNs t_ns) {
    ByteWriter bytes;
    write_ros_time(bytes, t_ns);
    return field(name, bytes.bytes());
  }
  const Bytes& bytes() const { return writer_.bytes(); }

 private:
  Head& field(const std::string& name, ByteSpan value) {
    ByteWriter pair;
    pair.raw(ByteWriter::as_bytes(name + "=")).raw(value);
    writer_.block(pair.bytes());
    return *this;
  }
  ByteWriter writer_;
};

struct Topic {
  std::string name;
  Bytes description;
};

struct IndexEntry {
  TimestampNs received_ns = 0;
  std::uint32_t offset = 0;
};
using ChunkIndex = std::map<std::uint32_t, std::vector<IndexEntry>>;  ///< by connection

struct ChunkInfo {
  std::uint64_t position = 0;
  TimestampNs first_ns = 0, last_ns = 0;
  std::map<std::uint32_t, std::uint32_t> counts;
};

Bytes connection_record(std::uint32_t id, const Topic& topic) {
  ByteWriter record;
  record.block(Head(RecordKind::connection).number("conn", id).text("topic", topic.name).bytes())
      .block(topic.description);
  return record.bytes();
}

Bytes index_record(std::uint32_t id, const std::vector<IndexEntry>& entries) {
  ByteWriter data, record;
  for (const IndexEntry& entry : entries) {
    write_ros_time(data, entry.received_ns);
    data.number(entry.offset);
  }
  const Head head = Head(RecordKind::index_data)
                        .number("ver", std::uint32_t{1})
                        .number("conn", id)
                        .number("count", static_cast<std::uint32_t>(entries.size()));
  record.block(head.bytes()).block(data.bytes());
  return record.bytes();
}

Bytes chunk_info_record(const ChunkInfo& info) {
  ByteWriter data, record;
  for (const auto& [id, count] : info.counts) data.number(id).number(count);
  const Head head = Head(RecordKind::chunk_info)
                        .number("ver", std::uint32_t{1})
                        .number("chunk_pos", info.position)
                        .time("start_time", info.first_ns)
                        .time("end_time", info.last_ns)
                        .number("count", static_cast<std::uint32_t>(info.counts.size()));
  record.block(head.bytes()).block(data.bytes());
  return record.bytes();
}

Bytes header_record(std::uint64_t index_position, std::size_t topics, std::size_t chunks) {
  const Head head = Head(RecordKind::bag_header)
                        .number("index_pos", index_position)
                        .number("conn_count", static_cast<std::uint32_t>(topics))
                        .number("chunk_count", static_cast<std::uint32_t>(chunks));
  ByteWriter record;
  record.block(head.bytes()).block(Bytes(kHeaderRecordBytes - 8 - head.bytes().size(), ' '));
  return record.bytes();
}

}  // namespace

struct BagWriter::State {
  std::string name;
  std::ofstream stream;
  Compression compression = Compression::none;
  std::vector<Topic> topics;
  ByteWriter chunk;
  ChunkIndex index;
  std::vector<ChunkInfo> infos;

  void put(ByteSpan bytes) {
    stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  void flush_chunk();
  ChunkInfo describe_chunk();
};

ChunkInfo BagWriter::State::describe_chunk() {
  ChunkInfo info{static_cast<std::uint64_t>(stream.tellp()), std::numeric_limits<TimestampNs>::max(), 0};
  for (const auto& [id, entries] : index) {
    info.counts[id] = static_cast<std::uint32_t>(entries.size());
    for (const IndexEntry& entry : entries) {
      info.first_ns = std::min(info.first_ns, entry.received_ns);
      info.last_ns = std::max(info.last_ns, entry.received_ns);
    }
  }
  return info;
}

void BagWriter::State::flush_chunk() {
  if (index.empty()) return;
  infos.push_back(describe_chunk());
  const Head head = Head(RecordKind::chunk)
                        .text("compression", name_of(compression))
                        .number("size", static_cast<std::uint32_t>(chunk.size()));
  ByteWriter record;
  record.block(head.bytes()).block(compress(chunk.bytes(), compression));
  put(record.bytes());
  for (const auto& [id, entries] : index) put(index_record(id, entries));
  chunk.clear();
  index.clear();
}

BagWriter::BagWriter(const std::filesystem::path& file, Compression compression) : state_(std::make_unique<State>()) {
  state_->name = file.string();
  state_->compression = compression;
  state_->stream.open(file, std::ios::binary | std::ios::trunc);
  if (!state_->stream) throw Error(file.string() + ": cannot be written; check the folder and its permissions");
  state_->put(ByteWriter::as_bytes(kMagic));
  state_->put(header_record(0, 0, 0));
}

BagWriter::~BagWriter() = default;

std::uint32_t BagWriter::add_topic(const std::string& topic, const std::string& type, const std::string& md5,
                                   const std::string& definition) {
  const Head description =
      Head().text("topic", topic).text("type", type).text("md5sum", md5).text("message_definition", definition);
  const auto id = static_cast<std::uint32_t>(state_->topics.size());
  state_->topics.push_back({topic, description.bytes()});
  state_->chunk.raw(connection_record(id, state_->topics.back()));
  return id;
}

void BagWriter::write(std::uint32_t topic, TimestampNs received_ns, const std::vector<std::uint8_t>& message) {
  State& state = *state_;
  state.index[topic].push_back({received_ns, static_cast<std::uint32_t>(state.chunk.size())});
  state.chunk.block(Head(RecordKind::message_data).number("conn", topic).time("time", received_ns).bytes())
      .block(message);
  if (state.chunk.size() >= kChunkBytes) state.flush_chunk();
}

void BagWriter::finish() {
  State& state = *state_;
  state.flush_chunk();
  const auto index_position = static_cast<std::uint64_t>(state.stream.tellp());
  for (std::uint32_t id = 0; id < state.topics.size(); ++id) state.put(connection_record(id, state.topics[id]));
  for (const ChunkInfo& info : state.infos) state.put(chunk_info_record(info));
  state.stream.seekp(static_cast<std::streamoff>(kMagic.size()));
  state.put(header_record(index_position, state.topics.size(), state.infos.size()));
  state.stream.close();
  if (!state.stream) throw Error(state.name + ": cannot be written to the end; is the disk full?");
}

}  // namespace demslam
