#include "formats/python/reading.h"

#include <pybind11/numpy.h>

#include <cstdint>
#include <utility>

#include "formats/error.h"
#include "formats/python/arrays.h"
#include "formats/stopped.h"

namespace cairn::formats::python {
namespace {

namespace py = pybind11;

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

}  // namespace

SectionSet Columns::sections(const DatasetHeader& header) const {
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

Reading::Reading(std::shared_ptr<const DatasetReader> dataset, std::vector<NodeId> order,
                 Columns columns)
    : dataset_(std::move(dataset)),
      order_(std::move(order)),
      columns_(std::move(columns)),
      wanted_(columns_.sections(dataset_->header())) {
  for (const NodeId id : order_) CAIRN_CHECK(value_of(id) < dataset_->tree().node_count());
  if (is_remote()) ahead_.emplace(*dataset_, wanted_, order_);
}

py::tuple Reading::node(std::size_t place) {
  CAIRN_CHECK(place < order_.size());
  NodeData data;
  {
    const py::gil_scoped_release unlocked;
    data = read(order_[place]);
  }
  return arrays(std::move(data));
}

NodeData Reading::read(NodeId id) {
  if (stop_.stop_requested()) throw Stopped{};  // nothing of what a pool of threads has left to do
  {
    const std::lock_guard lock(mutex_);
    if (ahead_) ahead_->next();
  }
  SectionSet wanted = wanted_;
  if (dataset_->tree().is_leaf(id)) wanted.reset(kWeightSection);  // all are 1
  return dataset_->read_node(id, wanted, stop_.get_token());
}

void Reading::stop() {
  stop_.request_stop();
  const std::lock_guard lock(mutex_);
  ahead_.reset();
}

py::tuple Reading::arrays(NodeData data) const {
  const DatasetHeader& header = dataset_->header();
  py::list attributes;
  for (const std::size_t attribute : columns_.attributes)
    attributes.append(
        attribute_array(std::move(data.attributes[attribute]), header.schema[attribute]));
  return py::make_tuple(
      array_over(std::move(data.position)), attributes, array_or_none(std::move(data.radius)),
      array_or_none(std::move(data.weight)), array_or_none(std::move(data.representative)));
}

}  // namespace cairn::formats::python
