#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "demslam/features/network_products.h"
#include "demslam/features/onnx_graph.h"

namespace demslam::nn {

using Arrays = std::vector<Array>;
/// One node of a network, ready to run: inputs (an empty array where an optional one is left out) to outputs.
using Step = std::function<Arrays(const Arrays&)>;

/// Thrown while steps are made: what this backend cannot do; the graph is then left to ONNX Runtime.
struct Uncovered {
  std::string reason;
};

/// A node while its step is made: attributes, constant inputs, and what all steps share. Every attribute must be asked
/// for, else the node counts as not covered.
class Site {
 public:
  Site(const OnnxNode& node, const std::map<std::string, Array>& constants, Engine& e, Products& p)
      : engine(e), products(p), node_(node), constants_(constants) {}

  Engine& engine;
  Products& products;

  std::int64_t integer(const std::string& name, std::int64_t otherwise) const;
  float number(const std::string& name, float otherwise) const;
  std::string text(const std::string& name, const std::string& otherwise) const;
  Dims integers(const std::string& name, const Dims& otherwise) const;
  /// Null when there is none.
  const OnnxConstant* tensor(const std::string& name) const;
  bool has(const std::string& name) const { return node_.attributes.contains(name); }
  void ignore(const std::string& name) const { asked_.insert(name); }

  std::size_t inputs() const { return node_.inputs.size(); }
  std::size_t outputs() const { return node_.outputs.size(); }
  bool has_input(std::size_t i) const { return i < node_.inputs.size() && !node_.inputs[i].empty(); }
  /// Empty where the input is left out; throws Uncovered where it is not constant.
  Array constant(std::size_t i) const;
  /// Integers of a constant input, or of the attribute that older operator sets have in its place.
  Dims constant_integers(std::size_t i, const std::string& attribute, const Dims& otherwise) const;

  /// Throws Uncovered, naming the operator.
  [[noreturn]] void refuse(const std::string& what) const;
  void require(bool fine, const std::string& what) const {
    if (!fine) refuse(what);
  }
  void check_all_asked() const;

 private:
  template <class T>
  const T* find(const std::string& name) const;

  const OnnxNode& node_;
  const std::map<std::string, Array>& constants_;
  mutable std::set<std::string> asked_;
};

/// Throws Uncovered when the operator, or an attribute of it, is not known here.
Step make_step(const OnnxNode& node, const std::map<std::string, Array>& constants, Engine& engine, Products& products);

Array to_array(Pool& pool, const OnnxConstant& constant);
Array integer_array(Pool& pool, const std::vector<std::int64_t>& values);

using Maker = Step (*)(const Site&);
using Makers = std::map<std::string, Maker>;
void add_elementwise_operators(Makers& makers);
void add_shape_operators(Makers& makers);
void add_index_operators(Makers& makers);
void add_reduction_operators(Makers& makers);
void add_layer_operators(Makers& makers);
void add_einsum_operator(Makers& makers);

/// Throws Error: a tensor is not what an operator takes.
void expect(bool fine, const char* what);

/// The view with axis `from` moved to place `to`.
Array with_axis_moved(const Array& a, std::size_t from, std::size_t to);
Array permuted(const Array& a, const Dims& order);

}  // namespace demslam::nn
