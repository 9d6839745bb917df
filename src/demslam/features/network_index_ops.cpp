#include <algorithm>
#include <numeric>

#include "demslam/features/network_kernels.h"
#include "demslam/features/network_operators.h"

namespace demslam::nn {
namespace {

std::int64_t checked_index(std::int64_t index, std::int64_t size) {
  const std::int64_t i = index < 0 ? index + size : index;
  expect(i >= 0 && i < size, "an index outside its tensor");
  return i;
}

std::byte* element(const Array& a, std::int64_t offset) {
  return a.start + offset * static_cast<std::int64_t>(size_of(a.type));
}

/// The slice at one place of an axis, which goes away.
Array slice_at(const Array& a, std::size_t axis, std::int64_t index) {
  Array view = a;
  view.start = element(a, index * a.strides[axis]);
  view.shape.erase(view.shape.begin() + static_cast<std::ptrdiff_t>(axis));
  view.strides.erase(view.strides.begin() + static_cast<std::ptrdiff_t>(axis));
  return view;
}

Step gather(const Site& site) {
  const std::int64_t wanted = site.integer("axis", 0);
  return [&engine = site.engine, wanted](const Arrays& in) -> Arrays {
    const Array& a = in.at(0);
    const std::size_t axis = axis_of(wanted, a.rank());
    const Dims indices = integers_of(in.at(1));
    if (in[1].rank() == 0) return {slice_at(a, axis, checked_index(indices.at(0), a.shape[axis]))};
    Dims shape = a.shape;
    shape[axis] = static_cast<std::int64_t>(indices.size());
    const Array out = make_array(engine.pool(), a.type, shape);
    for (std::size_t i = 0; i < indices.size(); ++i) {
      copy(slice_at(a, axis, checked_index(indices[i], a.shape[axis])),
           slice_at(out, axis, static_cast<std::int64_t>(i)));
    }
    shape.erase(shape.begin() + static_cast<std::ptrdiff_t>(axis));
    shape.insert(shape.begin() + static_cast<std::ptrdiff_t>(axis), in[1].shape.begin(), in[1].shape.end());
    return {reshaped(engine.pool(), out, shape)};
  };
}

Step gather_elements(const Site& site) {
  const std::int64_t wanted = site.integer("axis", 0);
  return [&engine = site.engine, wanted](const Arrays& in) -> Arrays {
    const Array &a = in.at(0), &where = in.at(1);
    const std::size_t axis = axis_of(wanted, a.rank());
    expect(where.rank() == a.rank(), "GatherElements of unequal ranks");
    const Dims indices = integers_of(where), steps = row_major(where.shape);
    const Array out = make_array(engine.pool(), a.type, where.shape);
    const std::size_t size = size_of(a.type);
    for (std::size_t i = 0; i < indices.size(); ++i) {
      std::int64_t offset = 0;
      for (std::size_t k = 0; k < a.rank(); ++k) {
        const std::int64_t own = static_cast<std::int64_t>(i) / steps[k] % where.shape[k];
        offset += checked_index(k == axis ? indices[i] : own, a.shape[k]) * a.strides[k];
      }
      std::copy_n(element(a, offset), size, out.start + i * size);
    }
    return {out};
  };
}

/// Offset of the slice that an index tuple names.
std::int64_t tuple_offset(const Array& a, const std::int64_t* tuple, std::int64_t length) {
  std::int64_t offset = 0;
  for (std::int64_t k = 0; k < length; ++k) offset += checked_index(tuple[k], a.shape[k]) * a.strides[k];
  return offset;
}

/// What is left of an array behind the axes that an index tuple names.
Array slice_behind(const Array& a, std::int64_t axes, std::int64_t offset) {
  return {a.type,
          {a.shape.begin() + axes, a.shape.end()},
          {a.strides.begin() + axes, a.strides.end()},
          a.memory,
          element(a, offset)};
}

/// Length of the index tuples of GatherND and ScatterND.
std::int64_t tuple_length(const Array& a, const Array& indices) {
  expect(indices.rank() > 0 && indices.shape.back() <= static_cast<std::int64_t>(a.rank()) && indices.shape.back() > 0,
         "index tuples longer than the tensor has axes");
  return indices.shape.back();
}

Step gather_nd(const Site& site) {
  site.require(site.integer("batch_dims", 0) == 0, "batch axes");
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    const Array& a = in.at(0);
    const std::int64_t length = tuple_length(a, in.at(1));
    const Dims tuples = integers_of(in[1]);
    const auto count = static_cast<std::int64_t>(tuples.size()) / length;
    Dims flat(a.shape.begin() + length, a.shape.end()), shape(in[1].shape.begin(), in[1].shape.end() - 1);
    shape.insert(shape.end(), flat.begin(), flat.end());
    flat.insert(flat.begin(), count);
    const Array out = make_array(engine.pool(), a.type, flat);
    for (std::int64_t i = 0; i < count; ++i) {
      copy(slice_behind(a, length, tuple_offset(a, &tuples[i * length], length)), slice_at(out, 0, i));
    }
    return {reshaped(engine.pool(), out, shape)};
  };
}

Step scatter_nd(const Site& site) {
  site.require(site.text("reduction", "none") == "none", "a reduction");
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    const Array& a = in.at(0);
    const std::int64_t length = tuple_length(a, in.at(1));
    const Dims tuples = integers_of(in[1]);
    const auto count = static_cast<std::int64_t>(tuples.size()) / length;
    const Array out = make_array(engine.pool(), a.type, a.shape);
    copy(a, out);
    Dims flat(a.shape.begin() + length, a.shape.end());
    flat.insert(flat.begin(), count);
    const Array updates = reshaped(engine.pool(), in.at(2), flat);
    for (std::int64_t i = 0; i < count; ++i) {
      copy(slice_at(updates, 0, i), slice_behind(out, length, tuple_offset(out, &tuples[i * length], length)));
    }
    return {out};
  };
}

Step non_zero(const Site& site) {
  return [&engine = site.engine](const Arrays& in) -> Arrays {
    const Array a = as_row_major(engine.pool(), in.at(0), Type::boolean);
    std::vector<std::int64_t> found;
    const std::int64_t count = a.count();
    for (std::int64_t i = 0; i < count; ++i) {
      if (a.data<bool>()[i]) found.push_back(i);
    }
    const auto rank = static_cast<std::int64_t>(a.rank()), columns = static_cast<std::int64_t>(found.size());
    const Array out = make_array(engine.pool(), Type::i64, {rank, columns});
    for (std::int64_t i = 0; i < columns; ++i) {
      for (std::int64_t k = 0; k < rank; ++k) {
        out.data<std::int64_t>()[k * columns + i] = found[i] / a.strides[k] % a.shape[k];
      }
    }
    return {out};
  };
}

/// The `count` largest of a row, largest first, of equal ones the first; `order` is room for all indices.
void select_largest(const float* row, std::int64_t size, std::int64_t count, std::vector<std::int64_t>& order) {
  order.resize(static_cast<std::size_t>(size));
  std::iota(order.begin(), order.end(), 0);
  const auto before = [row](std::int64_t a, std::int64_t b) { return row[a] > row[b] || (row[a] == row[b] && a < b); };
  std::partial_sort(order.begin(), order.begin() + count, order.end(), before);
}

/// Values and indices of the k largest along the last axis of rows.
Arrays largest_of_rows(Engine& engine, const Array& a, std::int64_t k) {
  const Array rows = as_row_major(engine.pool(), a, Type::f32);
  Dims shape = a.shape;
  const std::int64_t size = shape.back();
  expect(k >= 0 && k <= size, "TopK of more than there is");
  shape.back() = k;
  const Array values = make_array(engine.pool(), Type::f32, shape),
              indices = make_array(engine.pool(), Type::i64, shape);
  const std::int64_t count = size == 0 ? 0 : a.count() / size;
  engine.parallel((count + 63) / 64, [&](std::int64_t group) {
    std::vector<std::int64_t> order;
    for (std::int64_t r = group * 64; r < std::min(count, group * 64 + 64); ++r) {
      const float* row = rows.data<float>() + r * size;
      if (k == 1) {
        order = {place_of_largest(row, static_cast<std::size_t>(size))};
      } else {
        select_largest(row, size, k, order);
      }
      for (std::int64_t i = 0; i < k; ++i) {
        values.data<float>()[r * k + i] = row[order[i]];
        indices.data<std::int64_t>()[r * k + i] = order[i];
      }
    }
  });
  return {values, indices};
}

/// Values and places of the largest of each column of row-major matrices, the last two axes; their axis keeps length
/// one.
Arrays largest_of_columns(Engine& engine, const Array& a) {
  const Array in = as_row_major(engine.pool(), a, Type::f32);
  Dims shape = a.shape;
  const std::int64_t rows = shape.end()[-2], columns = shape.back(), size = rows * columns;
  shape.end()[-2] = 1;
  const Array values = make_array(engine.pool(), Type::f32, shape),
              places = make_array(engine.pool(), Type::i64, shape);
  expect(rows > 0, "the largest of nothing");
  const auto n = static_cast<std::size_t>(columns);
  for (std::int64_t m = 0; m < (size == 0 ? 0 : a.count() / size); ++m) {
    const float* matrix = in.data<float>() + m * size;
    float* best = values.data<float>() + m * columns;
    std::copy_n(matrix, n, best);
    std::vector<std::int32_t> place(n, 0);
    for (std::int64_t r = 1; r < rows; ++r) {
      update_best(matrix + r * columns, static_cast<std::int32_t>(r), n, best, place.data());
    }
    std::ranges::copy(place, places.data<std::int64_t>() + m * columns);
  }
  return {values, places};
}

/// Values and places of the k largest along an axis, largest first, of equal ones the first.
Arrays largest_along(Engine& engine, const Array& a, std::size_t axis, std::int64_t k) {
  if (k == 1 && axis + 2 == a.rank()) return largest_of_columns(engine, a);
  const std::size_t last = a.rank() - 1;
  Arrays found = largest_of_rows(engine, with_axis_moved(a, axis, last), k);
  for (Array& part : found) part = with_axis_moved(part, last, axis);
  return found;
}

Step top_k(const Site& site) {
  const std::int64_t wanted = site.integer("axis", -1);
  site.require(site.integer("largest", 1) == 1, "the smallest");
  site.ignore("sorted");
  return [&engine = site.engine, wanted](const Arrays& in) -> Arrays {
    return largest_along(engine, in.at(0), axis_of(wanted, in.at(0).rank()), integers_of(in.at(1)).at(0));
  };
}

Step arg_max(const Site& site) {
  const std::int64_t wanted = site.integer("axis", 0);
  const bool keep = site.integer("keepdims", 1) != 0;
  site.require(site.integer("select_last_index", 0) == 0, "the last of equal ones");
  return [&engine = site.engine, wanted, keep](const Arrays& in) -> Arrays {
    const std::size_t axis = axis_of(wanted, in.at(0).rank());
    const Array places = largest_along(engine, in[0], axis, 1)[1];
    return {keep ? places : slice_at(places, axis, 0)};
  };
}

}  // namespace

void add_index_operators(Makers& makers) {
  makers.insert({{"Gather", gather},
                 {"GatherElements", gather_elements},
                 {"GatherND", gather_nd},
                 {"ScatterND", scatter_nd},
                 {"NonZero", non_zero},
                 {"TopK", top_k},
                 {"ArgMax", arg_max}});
}

}  // namespace demslam::nn
