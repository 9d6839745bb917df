#include "demslam/dataset/yaml.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "demslam/base/error.h"
#include "demslam/base/text.h"

namespace demslam {

struct Yaml::Node {
  YAML::Node yaml;
  std::string source, name;
};

namespace {

/// yaml-cpp refuses OpenCV's "%YAML:1.0"; as a comment the line keeps the numbers of those below.
std::string without_directive(std::string text) {
  if (text.rfind("%YAML", 0) == 0) text.front() = '#';
  return text;
}

void append_numbers(const YAML::Node& node, std::vector<double>& numbers) {
  if (node.IsSequence()) {
    for (const YAML::Node& element : node) append_numbers(element, numbers);
  } else {
    numbers.push_back(node.as<double>());
  }
}

}  // namespace

Yaml::Yaml(std::unique_ptr<Node> node) : node_(std::move(node)) {}
Yaml::~Yaml() = default;
Yaml::Yaml(Yaml&&) noexcept = default;

Yaml Yaml::from_file(const std::filesystem::path& file) { return from_text(read_text(file), file.string()); }

Yaml Yaml::from_text(const std::string& text, const std::string& source) {
  try {
    return Yaml(std::make_unique<Node>(Node{YAML::Load(without_directive(text)), source, ""}));
  } catch (const YAML::ParserException& error) {
    throw Error::at(source, error.mark.line + 1, error.msg);
  }
}

void Yaml::fail(const std::string& message) const {
  throw Error::at(node_->source, std::max(node_->yaml.Mark().line, 0) + 1, message);
}

bool Yaml::has(const std::string& key) const { return node_->yaml.IsMap() && node_->yaml[key].IsDefined(); }

Yaml Yaml::operator[](const std::string& key) const {
  if (!has(key)) fail("key '" + node_->name + key + "' is missing");
  return Yaml(std::make_unique<Node>(Node{node_->yaml[key], node_->source, node_->name + key + "."}));
}

double Yaml::number() const {
  const std::vector<double> values = numbers();
  if (values.size() != 1) fail("'" + node_->name.substr(0, node_->name.size() - 1) + "' must be one number");
  return values.front();
}

std::string Yaml::text() const {
  if (!node_->yaml.IsScalar()) fail("'" + node_->name.substr(0, node_->name.size() - 1) + "' must be a text");
  return node_->yaml.Scalar();
}

std::vector<double> Yaml::numbers() const {
  std::vector<double> values;
  try {
    append_numbers(has("data") ? node_->yaml["data"] : node_->yaml, values);
  } catch (const YAML::BadConversion&) {
    values = {std::nan("")};
  }
  for (const double value : values) {
    if (!std::isfinite(value)) fail("'" + node_->name.substr(0, node_->name.size() - 1) + "' must hold finite numbers");
  }
  return values;
}

Pose Yaml::pose() const {
  const std::vector<double> values = numbers();
  if (values.size() != 16) fail("a transform must have 16 numbers (4x4, row-major)");
  const Eigen::Matrix4d m = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
  const Eigen::Matrix3d R = m.topLeftCorner<3, 3>();
  if (!(R * R.transpose()).isIdentity(1e-3) || R.determinant() < 0.0) fail("the matrix is not a rigid transform");
  return Pose(R, Eigen::Vector3d(m.topRightCorner<3, 1>()));
}

}  // namespace demslam
