#include "demslam/dataset/point_cloud.h"

#include <array>
#include <optional>
#include <sstream>

#include "demslam/base/error.h"
#include "demslam/base/text.h"
#include "demslam/dataset/bytes.h"

namespace demslam {
namespace {

/// A vertex property: where it lies in the record, and its type.
struct Property {
  std::size_t offset = 0;
  std::size_t column = 0;
  std::string type;
};

struct PlyHead {
  bool binary = false;
  std::size_t vertices = 0, stride = 0, end = 0;  ///< `end`: where the data begins
  std::array<std::optional<Property>, 3> xyz;
};

std::size_t size_of(const std::string& type, const std::string& source) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "int" || type == "uint" || type == "float" || type == "int32" || type == "uint32" || type == "float32") {
    return 4;
  }
  if (type == "double" || type == "float64") return 8;
  throw Error(source + ": vertices with a property of type '" + type + "' are not understood");
}

void add_property(std::istringstream& words, PlyHead& head, std::size_t column, const std::string& source) {
  std::string type, name;
  words >> type >> name;
  const std::string axes = "xyz";
  if (name.size() == 1 && axes.find(name) != std::string::npos) {
    head.xyz.at(axes.find(name)) = Property{head.stride, column, type};
  }
  head.stride += size_of(type, source);
}

PlyHead read_head(const std::string& bytes, const std::string& source) {
  PlyHead head;
  std::istringstream lines(bytes.substr(0, 4096));
  bool in_vertices = false;
  std::size_t column = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string key, value;
    words >> key;
    if (key == "format") {
      words >> value;
      head.binary = value == "binary_little_endian";
      if (!head.binary && value != "ascii") throw Error(source + ": PLY of the format '" + value + "' is not read");
    } else if (key == "element") {
      words >> value;
      in_vertices = value == "vertex";
      if (in_vertices) words >> head.vertices;
    } else if (key == "property" && in_vertices) {
      add_property(words, head, column++, source);
    } else if (key == "end_header") {
      head.end = static_cast<std::size_t>(lines.tellg());
      break;
    }
  }
  const bool complete = head.xyz[0] && head.xyz[1] && head.xyz[2];
  if (head.end == 0 || !complete) throw Error(source + ": a PLY whose vertices have no x, y, z is no point cloud");
  return head;
}

double value_at(ByteSpan bytes, const std::string& type, const std::string& source) {
  ByteReader reader(bytes, source);
  return type == "double" || type == "float64" ? reader.number<double>() : static_cast<double>(reader.number<float>());
}

std::vector<Eigen::Vector3d> binary_points(const std::string& bytes, const PlyHead& head, const std::string& source) {
  if (bytes.size() < head.end + head.vertices * head.stride) {
    throw Error(source + ": ends before its " + std::to_string(head.vertices) + " points; the file is truncated");
  }
  std::vector<Eigen::Vector3d> points(head.vertices);
  for (std::size_t i = 0; i < head.vertices; ++i) {
    const ByteSpan record = ByteWriter::as_bytes(bytes).subspan(head.end + i * head.stride, head.stride);
    for (int axis = 0; axis < 3; ++axis) {
      const Property& property = *head.xyz.at(axis);
      points[i][axis] = value_at(record.subspan(property.offset), property.type, source);
    }
  }
  return points;
}

std::vector<Eigen::Vector3d> table_points(const TextTable& table, const std::array<std::size_t, 3>& columns,
                                          std::size_t most) {
  std::vector<Eigen::Vector3d> points;
  for (const TextRow& row : table.rows) {
    if (points.size() == most) break;
    points.emplace_back(table.number(row, columns[0]), table.number(row, columns[1]), table.number(row, columns[2]));
  }
  return points;
}

}  // namespace

std::vector<Eigen::Vector3d> read_point_cloud(const std::filesystem::path& file) {
  const std::string bytes = read_text(file), source = file.string();
  if (bytes.rfind("ply", 0) != 0) return table_points(parse_table(bytes, source), {0, 1, 2}, bytes.size());
  const PlyHead head = read_head(bytes, source);
  if (head.binary) return binary_points(bytes, head, source);
  const TextTable table = parse_table(std::string_view(bytes).substr(head.end), source);
  if (table.rows.size() < head.vertices) {
    throw Error(source + ": has " + std::to_string(table.rows.size()) + " of its " + std::to_string(head.vertices) +
                " points; the file is truncated");
  }
  return table_points(table, {head.xyz[0]->column, head.xyz[1]->column, head.xyz[2]->column}, head.vertices);
}

}  // namespace demslam
