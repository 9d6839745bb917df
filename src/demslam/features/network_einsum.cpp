#include <algorithm>
#include <numeric>

#include "demslam/features/network_operators.h"

namespace demslam::nn {
namespace {

/// "bhid,bhjd->bhij": letters of the two factors and of the result.
struct Equation {
  std::string left, right, result;
};

Equation parse(const Site& site) {
  std::string text = site.text("equation", "");
  std::erase(text, ' ');
  const std::size_t comma = text.find(','), arrow = text.find("->");
  site.require(comma != std::string::npos && arrow != std::string::npos && comma < arrow && site.inputs() == 2 &&
                   text.find('.') == std::string::npos,
               "equation '" + text + "'");
  Equation e{text.substr(0, comma), text.substr(comma + 1, arrow - comma - 1), text.substr(arrow + 2)};
  for (const std::string* letters : {&e.left, &e.right, &e.result}) {
    for (const char letter : *letters) {
      site.require(std::ranges::count(*letters, letter) == 1 && letter != ',', "equation '" + text + "'");
    }
  }
  return e;
}

bool has(const std::string& letters, char letter) { return letters.find(letter) != std::string::npos; }

/// Letters by what becomes of them, in the order of a matrix product.
struct Roles {
  std::string batch, rows, depth, columns;
};

Roles roles_of(const Site& site, const Equation& e) {
  Roles roles;
  for (const char letter : e.left) {
    (has(e.right, letter) ? (has(e.result, letter) ? roles.batch : roles.depth) : roles.rows) += letter;
  }
  for (const char letter : e.right) {
    if (!has(e.left, letter)) roles.columns += letter;
  }
  const std::string wanted = roles.batch + roles.rows + roles.columns;
  site.require(wanted.size() == e.result.size() && std::ranges::is_permutation(wanted, e.result),
               "sums over one factor alone");
  return roles;
}

Dims order_of(const std::string& letters, const std::string& wanted) {
  Dims order;
  for (const char letter : wanted) order.push_back(static_cast<std::int64_t>(letters.find(letter)));
  return order;
}

/// A factor as [batch, a, b], each of them some axes in one.
Array as_matrices(Pool& pool, const Array& factor, const std::string& letters, const std::string& batch,
                  const std::string& a, const std::string& b) {
  expect(factor.rank() == letters.size(), "an Einsum of other axes");
  const Array turned = permuted(factor, order_of(letters, batch + a + b));
  const auto first = turned.shape.begin(), middle = first + static_cast<std::ptrdiff_t>(batch.size()),
             last = middle + static_cast<std::ptrdiff_t>(a.size());
  return reshaped(
      pool, turned,
      {count_of(Dims(first, middle)), count_of(Dims(middle, last)), count_of(Dims(last, turned.shape.end()))});
}

Step einsum(const Site& site) {
  const Equation e = parse(site);
  const Roles roles = roles_of(site, e);
  return [&engine = site.engine, &products = site.products, e, roles](const Arrays& in) -> Arrays {
    const Array left = as_matrices(engine.pool(), in.at(0), e.left, roles.batch, roles.rows, roles.depth),
                right = as_matrices(engine.pool(), in.at(1), e.right, roles.batch, roles.depth, roles.columns);
    const std::string made = roles.batch + roles.rows + roles.columns;
    Dims shape;
    for (const char letter : made) {
      const bool on_left = has(e.left, letter);
      shape.push_back(in[on_left ? 0 : 1].shape[(on_left ? e.left : e.right).find(letter)]);
    }
    const Array product = multiply(engine, products, left, right);
    return {permuted(reshaped(engine.pool(), product, shape), order_of(made, e.result))};
  };
}

}  // namespace

void add_einsum_operator(Makers& makers) { makers.insert({{"Einsum", einsum}}); }

}  // namespace demslam::nn
