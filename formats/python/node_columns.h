// What the index says of all nodes, as NumPy columns.
#pragma once

#include <pybind11/pybind11.h>

#include "formats/dataset/dataset_reader.h"

namespace cairn::formats::python {

/// A new array a field, each with one entry a node in id order. Boxes are (nodes, 2, 3): least and greatest corner, both
/// ends included. A root has the parent -1, leaves have the first child -1.
pybind11::dict node_columns(const DatasetReader& reader);

}  // namespace cairn::formats::python
