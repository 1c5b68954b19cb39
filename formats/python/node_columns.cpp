#include "formats/python/node_columns.h"

#include <pybind11/numpy.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "formats/error.h"

namespace cairn::formats::python {
namespace {

namespace py = pybind11;

class Columns {
 public:
  explicit Columns(const DatasetReader& reader) : reader_(reader) {}

  /// One scalar a node.
  template <typename T, typename Field>
  void add(const char* name, Field&& field) {
    py::array_t<T> column(count());
    T* to = column.mutable_data();
    for (const NodeRecord& record : reader_.nodes()) *to++ = static_cast<T>(field(record));
    dict_[name] = std::move(column);
  }

  /// Values of the shape `shape` a node: field(record, to) writes them from `to` on.
  template <typename T, typename Field>
  void add_block(const char* name, std::vector<py::ssize_t> shape, Field&& field) {
    py::ssize_t values = 1;
    for (const py::ssize_t extent : shape) values *= extent;
    shape.insert(shape.begin(), count());
    py::array_t<T> column(shape);
    T* to = column.mutable_data();
    for (const NodeRecord& record : reader_.nodes()) {
      field(record, to);
      to += values;
    }
    dict_[name] = std::move(column);
  }
  py::dict take() && { return std::move(dict_); }

 private:
  py::ssize_t count() const { return static_cast<py::ssize_t>(reader_.nodes().size()); }

  const DatasetReader& reader_;
  py::dict dict_;
};

void add_tree(const DatasetReader& reader, Columns& columns) {
  const Tree& tree = reader.tree();
  columns.add<std::uint64_t>("id", [](const NodeRecord& r) { return value_of(r.id); });
  columns.add<std::uint32_t>("level", [&](const NodeRecord& r) { return tree.level_of(r.id); });
  columns.add<std::int64_t>("parent", [&](const NodeRecord& r) {
    return value_of(r.id) == 0 ? -1 : static_cast<std::int64_t>(value_of(tree.parent(r.id)));
  });
  columns.add<std::int64_t>("first_child", [&](const NodeRecord& r) {
    return tree.is_leaf(r.id) ? -1 : static_cast<std::int64_t>(value_of(tree.first_child(r.id)));
  });
}

void add_boxes(const Grid& grid, Columns& columns) {
  columns.add_block<double>("box", {2, 3}, [&](const NodeRecord& r, double* to) {
    const WorldPoint low = grid.world(r.box.min), high = grid.world(r.box.max);
    std::copy(high.begin(), high.end(), std::copy(low.begin(), low.end(), to));
  });
  columns.add_block<std::int32_t>("grid_box", {2, 3}, [](const NodeRecord& r, std::int32_t* to) {
    std::copy(r.box.max.begin(), r.box.max.end(),
              std::copy(r.box.min.begin(), r.box.min.end(), to));
  });
}

void add_quality(Columns& columns) {
  columns.add<double>("rms", [](const NodeRecord& r) { return r.rms; });
  columns.add<double>("bound", [](const NodeRecord& r) { return r.bound; });
  columns.add<float>("theta", [](const NodeRecord& r) { return r.theta; });
  columns.add<std::uint32_t>("grid", [](const NodeRecord& r) { return r.grid; });
  columns.add<float>("radius_min", [](const NodeRecord& r) { return r.radius_min; });
  columns.add<float>("radius_max", [](const NodeRecord& r) { return r.radius_max; });
  columns.add<float>("cover_factor", [](const NodeRecord& r) { return r.cover_factor; });
  columns.add_block<float>("cone_axis", {3}, [](const NodeRecord& r, float* to) {
    std::copy(r.cone.axis.begin(), r.cone.axis.end(), to);
  });
  columns.add<float>("cone_cosine", [](const NodeRecord& r) { return r.cone.min_cosine; });
}

/// The sections of a node lie one behind the other: where the first is and how long they are together.
void add_storage(std::size_t sections, Columns& columns) {
  columns.add<std::uint8_t>("position_bits", [](const NodeRecord& r) { return r.position_bits; });
  columns.add<std::uint64_t>("offset",
                             [](const NodeRecord& r) { return r.sections.front().offset; });
  columns.add<std::uint64_t>("bytes", [](const NodeRecord& r) {
    std::uint64_t total = 0;
    for (const SectionRef& section : r.sections) total += section.size_bytes;
    return total;
  });
  columns.add_block<std::uint32_t>("section_bytes", {static_cast<py::ssize_t>(sections)},
                                   [&](const NodeRecord& r, std::uint32_t* to) {
                                     CAIRN_CHECK(r.sections.size() == sections);
                                     for (const SectionRef& section : r.sections)
                                       *to++ = section.size_bytes;
                                   });
}

}  // namespace

py::dict node_columns(const DatasetReader& reader) {
  Columns columns(reader);
  add_tree(reader, columns);
  columns.add<std::uint32_t>("point_count", [](const NodeRecord& r) { return r.point_count; });
  columns.add<std::uint64_t>("weight", [](const NodeRecord& r) { return r.weight; });
  add_boxes(reader.header().grid, columns);
  add_quality(columns);
  add_storage(kFirstAttributeSection + reader.header().schema.size(), columns);
  return std::move(columns).take();
}

}  // namespace cairn::formats::python
