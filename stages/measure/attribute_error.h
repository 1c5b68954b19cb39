// How far the attributes of leaf points are from those of their representatives.
#pragma once

#include <string>
#include <vector>

#include "formats/dataset/node_data.h"
#include "formats/schema.h"
#include "stages/measure/deviation.h"

namespace cairn::stages {

/// An attribute whose values are averaged, and so can be wrong by little or much.
struct MeasuredAttribute {
  std::size_t index = 0;  ///< in the schema
  formats::Attribute attribute;
};
std::vector<MeasuredAttribute> measured_attributes(const formats::Schema& schema);

/// Adds the deviations of all points of a leaf from those that stand for them in a node above. Of a normal it is the angle
/// between the two, in degrees, where both are there; of other attributes the difference, in their own units, of each
/// component that is a finite number on both sides. `stands_for`: as NodePath::stands_for.
void add_deviations(const MeasuredAttribute& measured, const formats::NodeData& leaf,
                    const formats::NodeData& above, const std::vector<std::uint32_t>& stands_for,
                    Deviation& deviation);

}  // namespace cairn::stages
