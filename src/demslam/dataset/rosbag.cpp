#include "demslam/dataset/rosbag.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <deque>
#include <map>
#include <mutex>

#include "demslam/base/error.h"
#include "demslam/dataset/bytes.h"
#include "demslam/dataset/compression.h"
#include "demslam/dataset/rosbag_format.h"

namespace demslam {
namespace {

constexpr std::uint32_t kLargestChunk = 1U << 30U;
constexpr std::size_t kKeptChunks = 4;

/// A file read at positions, by any number of threads.
class PositionedFile {
 public:
  explicit PositionedFile(const std::filesystem::path& file) : name_(file.string()) {
    if (std::filesystem::is_regular_file(file)) descriptor_ = ::open(name_.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor_ < 0) {
      throw Error(name_ + ": cannot be read; check the path and its permissions");
    }
    size_ = std::filesystem::file_size(file);
  }
  ~PositionedFile() { ::close(descriptor_); }
  PositionedFile(const PositionedFile&) = delete;
  PositionedFile& operator=(const PositionedFile&) = delete;

  const std::string& name() const { return name_; }
  std::uint64_t size() const { return size_; }

  Bytes read(std::uint64_t position, std::uint64_t count) const {
    if (position > size_ || count > size_ - position) {
      throw Error(name_ + ": ends after " + std::to_string(size_) +
                  " bytes, in the middle of a record; the bag is truncated");
    }
    Bytes bytes(count);
    for (std::size_t done = 0; done < count;) {
      const ssize_t got = ::pread(descriptor_, bytes.data() + done, count - done, static_cast<off_t>(position + done));
      if (got <= 0) throw Error(name_ + ": cannot be read at byte " + std::to_string(position + done));
      done += static_cast<std::size_t>(got);
    }
    return bytes;
  }
  std::uint32_t word(std::uint64_t position) const {
    const Bytes bytes = read(position, 4);
    return ByteReader(bytes, name_).number<std::uint32_t>();
  }

 private:
  std::string name_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

/// A record's head, and where its data lies in the file.
struct Record {
  RecordFields fields;
  std::uint64_t data = 0, data_size = 0;
  std::uint64_t end() const { return data + data_size; }
};

Record read_record(const PositionedFile& file, std::uint64_t position) {
  const std::uint32_t head_size = file.word(position);
  const Bytes head = file.read(position + 4, head_size);
  Record record{parse_fields(head, file.name())};
  record.data = position + 4 + head_size + 4;
  record.data_size = file.word(record.data - 4);
  return record;
}

Record read_record(const PositionedFile& file, std::uint64_t position, RecordKind kind) {
  Record record = read_record(file, position);
  if (record.fields.kind() != kind) {
    throw Error(file.name() + ": another record than expected at byte " + std::to_string(position) +
                "; the bag is damaged");
  }
  return record;
}

struct Chunk {
  std::uint64_t data = 0, data_size = 0;
  Compression compression = Compression::none;
  std::uint32_t unpacked_size = 0;
};

}  // namespace

struct Bag::State {
  explicit State(const std::filesystem::path& path) : file(path) {}

  PositionedFile file;
  std::vector<BagConnection> connections;
  std::vector<Chunk> chunks;
  std::map<std::uint32_t, std::vector<BagMessage>> messages;  ///< by connection

  mutable std::mutex mutex;
  mutable std::deque<std::pair<std::size_t, std::shared_ptr<const Bytes>>> unpacked;  ///< the last chunks, newest first

  void read_index();
  void read_connection(const Record& record);
  void read_chunk(const Record& info);
  void read_chunk_index(const Record& index);
  std::shared_ptr<const Bytes> unpack(std::size_t chunk) const;
};

void Bag::State::read_index() {
  const std::string magic = "#ROSBAG V2.0\n";
  if (file.size() < magic.size() || ByteReader::to_text(file.read(0, magic.size())) != magic) {
    throw Error(file.name() + ": is no ROS 1 bag of format 2.0");
  }
  const Record head = read_record(file, magic.size(), RecordKind::bag_header);
  std::uint64_t position = head.fields.number<std::uint64_t>("index_pos");
  if (position == 0)
    throw Error(file.name() + ": the bag has no index, its recording was cut off; run 'rosbag reindex' on it");
  const auto connection_count = head.fields.number<std::uint32_t>("conn_count");
  const auto chunk_count = head.fields.number<std::uint32_t>("chunk_count");
  for (std::uint32_t i = 0; i < connection_count; ++i) {
    const Record record = read_record(file, position, RecordKind::connection);
    read_connection(record);
    position = record.end();
  }
  for (std::uint32_t i = 0; i < chunk_count; ++i) {
    const Record record = read_record(file, position, RecordKind::chunk_info);
    read_chunk(record);
    position = record.end();
  }
  for (auto& [connection, list] : messages) {
    std::stable_sort(list.begin(), list.end(),
                     [](const BagMessage& a, const BagMessage& b) { return a.received_ns < b.received_ns; });
  }
}

void Bag::State::read_connection(const Record& record) {
  const Bytes data = file.read(record.data, record.data_size);
  const RecordFields description = parse_fields(data, file.name());
  connections.push_back(
      {record.fields.number<std::uint32_t>("conn"), record.fields.text("topic"), description.text("type")});
}

void Bag::State::read_chunk(const Record& info) {
  const Record record = read_record(file, info.fields.number<std::uint64_t>("chunk_pos"), RecordKind::chunk);
  const Chunk chunk{record.data, record.data_size, compression_named(record.fields.text("compression"), file.name()),
                    record.fields.number<std::uint32_t>("size")};
  if (chunk.unpacked_size > kLargestChunk)
    throw Error(file.name() + ": a chunk claims over a gigabyte; the bag is damaged");
  chunks.push_back(chunk);
  std::uint64_t position = record.end();
  for (auto left = info.fields.number<std::uint32_t>("count"); left > 0; --left) {  // one index per connection
    const Record index = read_record(file, position, RecordKind::index_data);
    read_chunk_index(index);
    position = index.end();
  }
}

void Bag::State::read_chunk_index(const Record& index) {
  const Bytes data = file.read(index.data, index.data_size);
  std::vector<BagMessage>& list = messages[index.fields.number<std::uint32_t>("conn")];
  for (ByteReader reader(data, file.name()); !reader.empty();) {
    const TimestampNs received_ns = read_ros_time(reader);
    list.push_back({received_ns, chunks.size() - 1, reader.number<std::uint32_t>()});
  }
}

std::shared_ptr<const Bytes> Bag::State::unpack(std::size_t index) const {
  const std::scoped_lock lock(mutex);
  const auto kept =
      std::find_if(unpacked.begin(), unpacked.end(), [&](const auto& entry) { return entry.first == index; });
  if (kept != unpacked.end()) return kept->second;
  const Chunk& chunk = chunks.at(index);
  const Bytes packed = file.read(chunk.data, chunk.data_size);
  auto bytes = std::make_shared<const Bytes>(decompress(packed, chunk.compression, chunk.unpacked_size, file.name()));
  unpacked.emplace_front(index, bytes);
  if (unpacked.size() > kKeptChunks) unpacked.pop_back();
  return bytes;
}

Bag::Bag(const std::filesystem::path& file) : state_(std::make_unique<State>(file)) { state_->read_index(); }
Bag::~Bag() = default;
Bag::Bag(Bag&&) noexcept = default;

const std::string& Bag::source() const { return state_->file.name(); }

const std::vector<BagConnection>& Bag::connections() const { return state_->connections; }

std::vector<BagMessage> Bag::messages(const std::string& topic) const {
  std::vector<BagMessage> found;
  for (const BagConnection& connection : state_->connections) {
    const auto list = state_->messages.find(connection.id);
    if (connection.topic != topic || list == state_->messages.end()) continue;
    const auto middle = static_cast<std::ptrdiff_t>(found.size());
    found.insert(found.end(), list->second.begin(), list->second.end());
    std::inplace_merge(found.begin(), found.begin() + middle, found.end(),
                       [](const BagMessage& a, const BagMessage& b) { return a.received_ns < b.received_ns; });
  }
  return found;
}

Bytes Bag::read(const BagMessage& message, std::size_t limit) const {
  const Chunk& chunk = state_->chunks.at(message.chunk);
  if (chunk.compression == Compression::none) {
    const Record record = read_record(state_->file, chunk.data + message.offset, RecordKind::message_data);
    return state_->file.read(record.data, std::min<std::uint64_t>(record.data_size, limit));
  }
  const std::shared_ptr<const Bytes> bytes = state_->unpack(message.chunk);
  ByteReader reader(*bytes, source());
  reader.take(message.offset);
  reader.block();  // the record's head
  const ByteSpan data = reader.block();
  return {data.begin(), data.begin() + static_cast<std::ptrdiff_t>(std::min(data.size(), limit))};
}

}  // namespace demslam
