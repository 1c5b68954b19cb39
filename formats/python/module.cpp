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
#include "formats/error.h"
#include "formats/python/arrays.h"
#include "formats/python/errors.h"
#include "formats/python/node_columns.h"

namespace cairn::formats::python {
namespace {

namespace py = pybind11;

using Steps = py::array_t<std::int32_t, py::array::c_style>;  // others are refused, not converted

/// A reader that can be closed. Whoever reads meanwhile holds it until done.
class Reader {
 public:
  explicit Reader(const std::string& location) {
    const py::gil_scoped_release unlocked;
    reader_.reset(new const DatasetReader(DatasetReader::open(location)));
  }

  ~Reader() { close(); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  /// What has to be waited for does not hold up other threads of Python.
  void close() {
    std::shared_ptr<const DatasetReader> reader = std::move(reader_);
    const py::gil_scoped_release unlocked;
    reader.reset();
  }
  bool closed() const { return reader_ == nullptr; }

  /// The reader itself, which stays even if another thread closes this one.
  std::shared_ptr<const DatasetReader> get() const {
    if (closed()) throw_usage("the dataset is closed");
    return reader_;
  }

 private:
  std::shared_ptr<const DatasetReader> reader_;
};

/// What all nodes share.
py::dict describe(const Reader& closable) {
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

SectionSet sections(const DatasetHeader& header, const std::vector<std::size_t>& attributes,
                    bool radius, bool weight, bool representative) {
  SectionSet wanted;
  wanted.set(kPositionSection);
  wanted.set(kRadiusSection, radius);
  wanted.set(kWeightSection, weight);
  wanted.set(kRepresentativeSection, representative);
  for (const std::size_t attribute : attributes) {
    CAIRN_CHECK(attribute < header.schema.size());
    wanted.set(kFirstAttributeSection + attribute);
  }
  return wanted;
}

/// The column of an attribute: (points) or, of several components, (points, components). None where the node has none.
py::object attribute_array(std::vector<std::byte> column, const Attribute& attribute) {
  if (column.empty()) return py::none();
  const auto count = static_cast<py::ssize_t>(column.size() / attribute.size_bytes());
  std::vector<py::ssize_t> shape{count};
  if (attribute.components > 1) shape.push_back(attribute.components);
  return array_over(std::move(column), dtype_of(attribute.type), std::move(shape));
}

template <typename T>
py::object array_or_none(std::vector<T> column) {
  return column.empty() ? py::object(py::none()) : py::object(array_over(std::move(column)));
}

/// Columns of a node, each an array of its own: steps, the attributes in the order asked for, radius, weight,
/// representative. What is not asked for, or not there, is None.
py::tuple read_node(const Reader& closable, std::uint64_t id,
                    const std::vector<std::size_t>& attributes, bool radius, bool weight,
                    bool representative) {
  const auto reader = closable.get();
  const DatasetHeader& header = reader->header();
  const SectionSet wanted = sections(header, attributes, radius, weight, representative);
  NodeData data;
  {
    const py::gil_scoped_release unlocked;
    data = reader->read_node(NodeId{id}, wanted);
  }
  py::list columns;
  for (const std::size_t attribute : attributes)
    columns.append(
        attribute_array(std::move(data.attributes[attribute]), header.schema[attribute]));
  return py::make_tuple(
      array_over(std::move(data.position)), columns, array_or_none(std::move(data.radius)),
      array_or_none(std::move(data.weight)), array_or_none(std::move(data.representative)));
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
  register_errors();
  py::class_<Reader>(module, "Reader", "An open dataset: index in memory, nodes on demand.")
      .def(py::init<const std::string&>(), py::arg("location"))
      .def("close", &Reader::close)
      .def_property_readonly("closed", &Reader::closed)
      .def("describe", &describe)
      .def("metadata", [](const Reader& reader) { return py::bytes(reader.get()->metadata()); })
      .def("node_columns", [](const Reader& reader) { return node_columns(*reader.get()); })
      .def(
          "block_starts",
          [](const Reader& reader, std::uint64_t id) {
            return reader.get()->record(cairn::formats::NodeId{id}).block_start;
          },
          py::arg("id"))
      .def("read_node", &read_node, py::arg("id"), py::arg("attributes"), py::arg("radius"),
           py::arg("weight"), py::arg("representative"));
  module.def("to_world", &to_world, py::arg("steps").noconvert(), py::arg("step"),
             py::arg("offset"), py::arg("shift"));
}
