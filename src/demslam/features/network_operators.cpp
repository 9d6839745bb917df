#include "demslam/features/network_operators.h"

#include <algorithm>
#include <numeric>

#include "demslam/base/error.h"

namespace demslam::nn {
namespace {

const Makers& makers() {
  static const Makers all = [] {
    Makers made;
    add_elementwise_operators(made);
    add_shape_operators(made);
    add_index_operators(made);
    add_reduction_operators(made);
    add_layer_operators(made);
    add_einsum_operator(made);
    return made;
  }();
  return all;
}

}  // namespace

template <class T>
const T* Site::find(const std::string& name) const {
  asked_.insert(name);
  const auto found = node_.attributes.find(name);
  if (found == node_.attributes.end()) return nullptr;
  const T* value = std::get_if<T>(&found->second);
  if (value == nullptr) refuse("its attribute '" + name + "'");
  return value;
}

std::int64_t Site::integer(const std::string& name, std::int64_t otherwise) const {
  const auto* value = find<std::int64_t>(name);
  return value ? *value : otherwise;
}
float Site::number(const std::string& name, float otherwise) const {
  const auto* value = find<float>(name);
  return value ? *value : otherwise;
}
std::string Site::text(const std::string& name, const std::string& otherwise) const {
  const auto* value = find<std::string>(name);
  return value ? *value : otherwise;
}
Dims Site::integers(const std::string& name, const Dims& otherwise) const {
  const auto* value = find<Dims>(name);
  return value ? *value : otherwise;
}
const OnnxConstant* Site::tensor(const std::string& name) const { return find<OnnxConstant>(name); }

Array Site::constant(std::size_t i) const {
  if (!has_input(i)) return {};
  const auto found = constants_.find(node_.inputs[i]);
  if (found == constants_.end()) refuse("input " + std::to_string(i) + " that is not constant");
  return found->second;
}

Dims Site::constant_integers(std::size_t i, const std::string& attribute, const Dims& otherwise) const {
  if (has(attribute) || !has_input(i)) return integers(attribute, otherwise);
  return integers_of(constant(i));
}

void Site::refuse(const std::string& what) const {
  throw Uncovered{"operator " + (node_.domain.empty() ? "" : node_.domain + ".") + node_.op + " with " + what};
}

void Site::check_all_asked() const {
  for (const auto& [name, value] : node_.attributes) {
    if (!asked_.contains(name)) refuse("attribute '" + name + "'");
  }
}

Step make_step(const OnnxNode& node, const std::map<std::string, Array>& constants, Engine& engine,
               Products& products) {
  const auto found = makers().find(node.domain.empty() ? node.op : node.domain + "." + node.op);
  if (found == makers().end()) {
    throw Uncovered{"operator " + (node.domain.empty() ? "" : node.domain + ".") + node.op};
  }
  const Site site(node, constants, engine, products);
  Step step = found->second(site);
  site.check_all_asked();
  return step;
}

Array to_array(Pool& pool, const OnnxConstant& constant) {
  if (constant.kind == OnnxConstant::Kind::floats) {
    Array a = make_array(pool, Type::f32, constant.shape);
    std::ranges::copy(constant.floats, a.data<float>());
    return a;
  }
  const bool boolean = constant.kind == OnnxConstant::Kind::booleans;
  Array a = make_array(pool, boolean ? Type::boolean : Type::i64, constant.shape);
  for (std::size_t i = 0; i < constant.integers.size(); ++i) {
    if (boolean) {
      a.data<bool>()[i] = constant.integers[i] != 0;
    } else {
      a.data<std::int64_t>()[i] = constant.integers[i];
    }
  }
  return a;
}

Array integer_array(Pool& pool, const std::vector<std::int64_t>& values) {
  Array a = make_array(pool, Type::i64, {static_cast<std::int64_t>(values.size())});
  std::ranges::copy(values, a.data<std::int64_t>());
  return a;
}

void expect(bool fine, const char* what) {
  if (!fine) throw Error(what);
}

Array permuted(const Array& a, const Dims& order) {
  expect(order.size() == a.rank(), "a transposition of another number of axes");
  Array view = a;
  std::vector<bool> seen(a.rank(), false);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t from = axis_of(order[i], a.rank());
    expect(!seen[from], "a transposition that repeats an axis");
    seen[from] = true;
    view.shape[i] = a.shape[from];
    view.strides[i] = a.strides[from];
  }
  return view;
}

Array with_axis_moved(const Array& a, std::size_t from, std::size_t to) {
  Dims order(a.rank());
  std::iota(order.begin(), order.end(), 0);
  order.erase(order.begin() + static_cast<std::ptrdiff_t>(from));
  order.insert(order.begin() + static_cast<std::ptrdiff_t>(to), static_cast<std::int64_t>(from));
  return permuted(a, order);
}

}  // namespace demslam::nn
