#include "demslam/toml/toml.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>
#include <toml++/toml.hpp>

#include "demslam/base/error.h"

namespace demslam {

struct TomlReader::Node {
  std::shared_ptr<const toml::table> root;  ///< keeps `table` alive
  const toml::table* table = nullptr;
  std::string source, name;
  std::set<std::string, std::less<>> known;

  const toml::node* find(std::string_view key) {
    known.emplace(key);
    return table->get(key);
  }
};

namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row.back();
}

std::string nearest(std::string_view key, const std::set<std::string, std::less<>>& known) {
  const auto best = std::min_element(known.begin(), known.end(), [&](const auto& a, const auto& b) {
    return edit_distance(key, a) < edit_distance(key, b);
  });
  if (best == known.end() || edit_distance(key, *best) > std::max<std::size_t>(2, key.size() / 3)) return "";
  return "; did you mean '" + *best + "'?";
}

int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

std::string shortest(double value) {
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  std::string text(buffer, end);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::string quoted(const std::string& value) {
  std::ostringstream stream;
  stream << toml::value<std::string>(value);
  return stream.str();
}

template <class Range, class Format>
std::string bracketed(const Range& values, const Format& format) {
  std::string text = "[";
  for (const auto& value : values) text += (text.size() > 1 ? ", " : "") + format(value);
  return text + "]";
}

template <class Vector>
std::string coordinates(const Vector& point) {
  return bracketed(std::vector<double>(point.data(), point.data() + point.size()), shortest);
}

}  // namespace

TomlReader::TomlReader(std::unique_ptr<Node> node) : node_(std::move(node)) {}
TomlReader::~TomlReader() = default;
TomlReader::TomlReader(TomlReader&&) noexcept = default;
TomlReader& TomlReader::operator=(TomlReader&&) noexcept = default;

TomlReader TomlReader::from_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw Error(file.string() + ": cannot be read");
  std::ostringstream text;
  text << stream.rdbuf();
  return from_text(text.str(), file.string());
}

TomlReader TomlReader::from_text(const std::string& text, const std::string& source) {
  auto node = std::make_unique<Node>();
  node->source = source;
  try {
    node->root = std::make_shared<toml::table>(toml::parse(text, source));
  } catch (const toml::parse_error& error) {
    throw Error::at(source, static_cast<int>(error.source().begin.line), std::string(error.description()));
  }
  node->table = node->root.get();
  return TomlReader(std::move(node));
}

bool TomlReader::has(std::string_view key) const { return node_->table->contains(key); }

void TomlReader::require(std::string_view key) const {
  if (!has(key)) fail(key, "key '" + node_->name + std::string(key) + "' is missing");
}

void TomlReader::fail(std::string_view key, const std::string& message) const {
  const toml::node* found = node_->table->get(key);
  const int line = line_of(found != nullptr ? *found : *node_->table);
  throw Error::at(node_->source, std::max(line, 1), message);
}

void TomlReader::field(std::string_view key, double& value) {
  const toml::node* found = node_->find(key);
  if (found == nullptr) return;
  const auto number = found->value<double>();
  if (!number || !std::isfinite(*number)) fail(key, "'" + std::string(key) + "' must be a finite number");
  value = *number;
}

void TomlReader::field(std::string_view key, int& value) {
  const toml::node* found = node_->find(key);
  if (found == nullptr) return;
  const auto number = found->value_exact<std::int64_t>();
  if (!number || std::abs(*number) > std::numeric_limits<int>::max()) {
    fail(key, "'" + std::string(key) + "' must be an integer");
  }
  value = static_cast<int>(*number);
}

void TomlReader::field(std::string_view key, std::uint64_t& value) {
  const toml::node* found = node_->find(key);
  if (found == nullptr) return;
  const auto number = found->value_exact<std::int64_t>();
  if (!number || *number < 0) fail(key, "'" + std::string(key) + "' must be a non-negative integer");
  value = static_cast<std::uint64_t>(*number);
}

void TomlReader::field(std::string_view key, bool& value) {
  const toml::node* found = node_->find(key);
  if (found == nullptr) return;
  const auto flag = found->value_exact<bool>();
  if (!flag) fail(key, "'" + std::string(key) + "' must be true or false");
  value = *flag;
}

void TomlReader::field(std::string_view key, std::string& value) {
  const toml::node* found = node_->find(key);
  if (found == nullptr) return;
  const auto text = found->value_exact<std::string>();
  if (!text) fail(key, "'" + std::string(key) + "' must be a text in quotes");
  value = *text;
}

void TomlReader::field(std::string_view key, std::filesystem::path& value) {
  std::string text = value.string();
  field(key, text);
  value = text;
}

void TomlReader::field(std::string_view key, std::vector<double>& value) {
  const toml::node* found = node_->find(key);
  if (found == nullptr) return;
  const std::string message = "'" + std::string(key) + "' must be a list of finite numbers";
  const toml::array* array = found->as_array();
  if (array == nullptr) fail(key, message);
  std::vector<double> numbers;
  for (const toml::node& element : *array) {
    const auto number = element.value<double>();
    if (!number || !std::isfinite(*number)) fail(key, message);
    numbers.push_back(*number);
  }
  value = std::move(numbers);
}

void TomlReader::field(std::string_view key, std::vector<std::string>& value) {
  const toml::node* found = node_->find(key);
  if (found == nullptr) return;
  const std::string message = "'" + std::string(key) + "' must be a list of texts in quotes";
  const toml::array* array = found->as_array();
  if (array == nullptr) fail(key, message);
  std::vector<std::string> texts;
  for (const toml::node& element : *array) {
    const auto text = element.value_exact<std::string>();
    if (!text) fail(key, message);
    texts.push_back(*text);
  }
  value = std::move(texts);
}

void TomlReader::field(std::string_view key, Eigen::Vector2d& value) {
  std::vector<double> numbers(value.data(), value.data() + 2);
  field(key, numbers);
  if (numbers.size() != 2) fail(key, "'" + std::string(key) + "' must have 2 numbers");
  value = Eigen::Vector2d(numbers[0], numbers[1]);
}

void TomlReader::field(std::string_view key, Eigen::Vector3d& value) {
  std::vector<double> numbers(value.data(), value.data() + 3);
  field(key, numbers);
  if (numbers.size() != 3) fail(key, "'" + std::string(key) + "' must have 3 numbers");
  value = Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
}

template <class Vector>
void TomlReader::points(std::string_view key, std::vector<Vector>& value, const char* shape) {
  const toml::node* found = node_->find(key);
  if (found == nullptr) return;
  const std::string message = "'" + std::string(key) + "' must be a list of " + shape;
  const toml::array* array = found->as_array();
  if (array == nullptr) fail(key, message);
  std::vector<Vector> points;
  for (const toml::node& element : *array) {
    const toml::array* numbers = element.as_array();
    if (numbers == nullptr || numbers->size() != Vector::SizeAtCompileTime) fail(key, message);
    Vector& point = points.emplace_back();
    for (std::size_t i = 0; i < numbers->size(); ++i) {
      const auto number = numbers->get(i)->value<double>();
      if (!number || !std::isfinite(*number)) fail(key, message);
      point[static_cast<Eigen::Index>(i)] = *number;
    }
  }
  value = std::move(points);
}

void TomlReader::field(std::string_view key, std::vector<Eigen::Vector2d>& value) {
  points(key, value, "[x, y] pairs");
}

void TomlReader::field(std::string_view key, std::vector<Eigen::Vector3d>& value) {
  points(key, value, "[x, y, z] triples");
}

void TomlReader::field(std::string_view key, Pose& value) {
  if (!has(key)) return;
  std::vector<double> n;
  field(key, n);
  if (n.size() != 16) fail(key, "'" + std::string(key) + "' must have 16 numbers (4x4, row-major)");
  const Eigen::Matrix4d m = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(n.data());
  const Eigen::Matrix3d R = m.topLeftCorner<3, 3>();
  const bool rigid = (R * R.transpose()).isIdentity(1e-3) && R.determinant() > 0.0 &&
                     m.row(3).isApprox(Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0), 1e-9);
  if (!rigid) fail(key, "'" + std::string(key) + "' is not a rigid transform");
  value = Pose(R, Eigen::Vector3d(m.topRightCorner<3, 1>()));
}

void TomlReader::section(std::string_view key, const std::function<void(TomlReader&)>& body) {
  const toml::node* found = node_->find(key);
  if (found == nullptr) return;
  if (!found->is_table()) fail(key, "'" + std::string(key) + "' must be a table: [" + std::string(key) + "]");
  auto child = std::make_unique<Node>(*node_);
  child->table = found->as_table();
  child->name = node_->name + std::string(key) + ".";
  child->known.clear();
  TomlReader reader(std::move(child));
  body(reader);
  reader.reject_unknown();
}

void TomlReader::sections(std::string_view key, const std::function<void(TomlReader&)>& body) {
  const toml::node* found = node_->find(key);
  if (found == nullptr) return;
  const toml::array* array = found->as_array();
  if (array == nullptr || !array->is_array_of_tables()) {
    fail(key, "'" + std::string(key) + "' must be tables: [[" + std::string(key) + "]]");
  }
  for (const toml::node& element : *array) {
    auto child = std::make_unique<Node>(*node_);
    child->table = element.as_table();
    child->name = node_->name + std::string(key) + ".";
    child->known.clear();
    TomlReader reader(std::move(child));
    body(reader);
    reader.reject_unknown();
  }
}

void TomlReader::reject_unknown() const {
  for (const auto& [key, value] : *node_->table) {
    if (node_->known.count(key.str()) != 0) continue;
    throw Error::at(node_->source, static_cast<int>(key.source().begin.line),
                    "unknown key '" + node_->name + std::string(key.str()) + "'" + nearest(key.str(), node_->known));
  }
}

void TomlWriter::line(std::string_view key, const std::string& value) {
  text_ += std::string(key) + " = " + value + "\n";
}

void TomlWriter::field(std::string_view key, double value) { line(key, shortest(value)); }
void TomlWriter::field(std::string_view key, int value) { line(key, std::to_string(value)); }
void TomlWriter::field(std::string_view key, std::uint64_t value) { line(key, std::to_string(value)); }
void TomlWriter::field(std::string_view key, bool value) { line(key, value ? "true" : "false"); }
void TomlWriter::field(std::string_view key, const std::string& value) { line(key, quoted(value)); }
void TomlWriter::field(std::string_view key, const std::filesystem::path& value) { line(key, quoted(value.string())); }
void TomlWriter::field(std::string_view key, const std::vector<double>& value) {
  line(key, bracketed(value, shortest));
}
void TomlWriter::field(std::string_view key, const std::vector<std::string>& value) {
  line(key, bracketed(value, quoted));
}
void TomlWriter::field(std::string_view key, const Eigen::Vector2d& value) {
  line(key, bracketed(std::vector<double>(value.data(), value.data() + 2), shortest));
}
void TomlWriter::field(std::string_view key, const Eigen::Vector3d& value) {
  line(key, bracketed(std::vector<double>(value.data(), value.data() + 3), shortest));
}
void TomlWriter::field(std::string_view key, const std::vector<Eigen::Vector2d>& value) {
  line(key, bracketed(value, coordinates<Eigen::Vector2d>));
}
void TomlWriter::field(std::string_view key, const std::vector<Eigen::Vector3d>& value) {
  line(key, bracketed(value, coordinates<Eigen::Vector3d>));
}
void TomlWriter::field(std::string_view key, const Pose& value) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = value.matrix();
  line(key, bracketed(std::vector<double>(m.data(), m.data() + 16), shortest));
}

void TomlWriter::section(std::string_view key, const std::function<void(TomlWriter&)>& body) {
  TomlWriter child;
  child.prefix_ = prefix_ + std::string(key) + ".";
  body(child);
  text_ += "\n[" + prefix_ + std::string(key) + "]\n" + child.text_;
}

void TomlWriter::comment(std::string_view text) { text_ += "# " + std::string(text) + "\n"; }

}  // namespace demslam
