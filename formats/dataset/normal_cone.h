// The cone of a node's normals: what a renderer culls by.
#pragma once

#include <optional>

#include "formats/dataset/node_record.h"
#include "formats/dataset/normal_map.h"

namespace cairn::formats {

/// The cosine between the cone's axis and a normal of any length; nothing if either is zero.
std::optional<double> cone_cosine(const NormalCone& cone, const Normal& normal);

}  // namespace cairn::formats
