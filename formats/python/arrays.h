// NumPy arrays over memory that C++ allocated, without a copy: the array keeps its column alive through a capsule, and
// needs neither the dataset nor the node that it came from.
#pragma once

#include <pybind11/numpy.h>

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "formats/schema.h"

namespace cairn::formats::python {

/// Takes a column over. `type` and `shape` say what its bytes are, and must make up all of them.
template <typename T>
pybind11::array array_over(std::vector<T> column, const pybind11::dtype& type,
                           std::vector<pybind11::ssize_t> shape) {
  auto owner = std::make_unique<std::vector<T>>(std::move(column));
  void* bytes = owner->data();
  const pybind11::capsule capsule(owner.get(),
                                  [](void* owned) { delete static_cast<std::vector<T>*>(owned); });
  owner.release();  // the capsule has it now
  return pybind11::array(type, std::move(shape), bytes, capsule);
}

/// A column of scalars, one a point.
template <typename T>
pybind11::array array_over(std::vector<T> column) {
  const auto count = static_cast<pybind11::ssize_t>(column.size());
  return array_over(std::move(column), pybind11::dtype::of<T>(), {count});
}

/// A column of triples: shape (points, 3).
template <typename T>
pybind11::array array_over(std::vector<std::array<T, 3>> column) {
  const auto count = static_cast<pybind11::ssize_t>(column.size());
  return array_over(std::move(column), pybind11::dtype::of<T>(), {count, 3});
}

/// NumPy has the names of the format for its types.
inline pybind11::dtype dtype_of(ScalarType type) {
  return pybind11::dtype(std::string(name_of(type)));
}

}  // namespace cairn::formats::python
