// cairn._core: the dataset reader for Python. It hands over what is in the files as NumPy arrays and nothing more; what
// Python users see is written in Python, in formats/python/cairn/.
//
// Reading and decoding run without the interpreter's lock, so threads of Python read side by side.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "formats/dataset/normal_map.h"
#include "formats/error.h"
#include "formats/python/arrays.h"
#include "formats/python/errors.h"
#include "formats/python/node_columns.h"
#include "formats/python/reader.h"
#include "formats/python/reading.h"
#include "formats/python/shared.h"
#include "formats/vector_path.h"

namespace cairn::formats::python {
namespace {

namespace py = pybind11;

using Steps = py::array_t<std::int32_t, py::array::c_style>;  // others are refused, not converted

/// What all nodes share.
py::dict describe(Reader& closable) {
  const auto reader = closable.get();
  const DatasetHeader& header = reader->header();
  const Tree& tree = reader->tree();
  py::list schema;
  for (const Attribute& attribute : header.schema)
    schema.append(py::make_tuple(attribute.name, dtype_of(attribute.type), attribute.components,
                                 std::string(name_of(attribute.rule)), attribute.estimated));
  py::dict described;
  described["point_count"] = header.points;
  described["fanout"] = header.fanout;
  described["target_points"] = header.target_points;
  described["node_points"] = tree.node_points();
  described["node_count"] = tree.node_count();
  described["level_count"] = tree.leaf_level() + 1;
  described["grid"] = py::make_tuple(header.grid.step, header.grid.offset, header.grid.shift);
  described["schema"] = schema;
  described["radius_estimated"] = header.radius_origin != RadiusOrigin::kInput;
  described["lossless_leaves"] = header.lossless_leaves;
  described["replaces"] = header.refinement == Refinement::kReplace;
  return described;
}

std::shared_ptr<Reading> start_reading(Reader& reader, const std::vector<std::uint64_t>& ids,
                                       std::vector<std::size_t> attributes, bool radius,
                                       bool weight, bool representative) {
  auto dataset = reader.get();
  std::vector<NodeId> order;
  order.reserve(ids.size());
  for (const std::uint64_t id : ids) order.push_back(NodeId{id});
  const py::gil_scoped_release unlocked;
  return share(std::make_unique<Reading>(std::move(dataset), std::move(order),
                                         Columns{.attributes = std::move(attributes),
                                                 .radius = radius,
                                                 .weight = weight,
                                                 .representative = representative}));
}

/// Makes what C++ would make at its first use, guarded by locks: a process that is forked while another thread makes it would
/// wait for ever.
void make_tables() {
  vector_path();
  decoded_normals();
}

/// World coordinates of grid steps, (points, 3) both, by the one formula of formats/dataset/grid.h.
py::array_t<double> to_world(const Steps& steps, const std::array<double, 3>& step,
                             const std::array<double, 3>& offset,
                             const std::array<std::int64_t, 3>& shift) {
  if (steps.ndim() != 2 || steps.shape(1) != 3) throw_usage("steps are an array of shape (n, 3)");
  const Grid grid{step, offset, shift};
  const py::ssize_t count = steps.shape(0);
  py::array_t<double> world({count, py::ssize_t{3}});
  const std::int32_t* from = steps.data();
  double* to = world.mutable_data();
  const py::gil_scoped_release unlocked;
  for (py::ssize_t i = 0; i < count; ++i)
    for (int axis = 0; axis < 3; ++axis) *to++ = grid.world(axis, *from++);
  return world;
}

}  // namespace
}  // namespace cairn::formats::python

PYBIND11_MODULE(_core, module) {
  using namespace cairn::formats::python;
  namespace py = pybind11;
  module.doc() = "The reader behind the package cairn. Use the package.";
  module.attr("version") = CAIRN_VERSION;
  register_errors();
  make_tables();
  py::class_<Reader>(module, "Reader", "An open dataset: index in memory, nodes on demand.")
      .def(py::init<const std::string&, const std::string&, bool, std::uint64_t>(),
           py::arg("location"), py::arg("cache_folder"), py::arg("must_cache"),
           py::arg("cache_bytes"))
      .def("close", &Reader::close)
      .def_property_readonly("closed", &Reader::closed)
      .def("describe", &describe)
      .def("metadata", [](Reader& reader) { return py::bytes(reader.get()->metadata()); })
      .def("node_columns", [](Reader& reader) { return node_columns(*reader.get()); })
      .def(
          "block_starts",
          [](Reader& reader, std::uint64_t id) {
            return reader.get()->record(cairn::formats::NodeId{id}).block_start;
          },
          py::arg("id"))
      .def("reading", &start_reading, py::arg("ids"), py::arg("attributes"), py::arg("radius"),
           py::arg("weight"), py::arg("representative"));
  py::class_<Reading, std::shared_ptr<Reading>>(module, "Reading", "Some nodes, being read.")
      .def("node", &Reading::node, py::arg("place"))
      .def("stop", &Reading::stop, py::call_guard<py::gil_scoped_release>());
  module.def("default_cache_folder",
             [] { return py::bytes(cairn::formats::default_cache_folder().string()); });
  module.def("to_world", &to_world, py::arg("steps").noconvert(), py::arg("step"),
             py::arg("offset"), py::arg("shift"));
}
