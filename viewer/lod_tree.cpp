#include "viewer/lod_tree.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <string>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

/// The box of grid points in world units, rounded outwards: culling may not lose what touches an edge.
Box world_box(const formats::Grid& grid, const formats::GridBox& box) {
  Box world;
  for (int axis = 0; axis < 3; ++axis) {
    const double least = grid.world(axis, box.min[axis]);
    const double greatest = grid.world(axis, box.max[axis]);
    world.center[axis] = least + (greatest - least) / 2;
    const double half = std::max(greatest - world.center[axis], world.center[axis] - least);
    world.half[axis] = std::nextafter(half, std::numeric_limits<double>::infinity());
  }
  return world;
}

LodNode lod_node(const formats::Grid& grid, const formats::NodeRecord& record) {
  const auto& axis = record.cone.axis;
  return {.box = world_box(grid, record.box),
          .cone = {.axis = {axis[0], axis[1], axis[2]}, .min_cosine = record.cone.min_cosine},
          .bound = record.bound,
          .radius_max = record.radius_max,
          .reach = record.radius_max,
          .points = record.point_count};
}

/// The cone, around the axis of `own`, of all normals of two cones. One without an axis tells nothing, so that with it
/// nothing is culled.
Cone joined(const Cone& own, const Cone& other) {
  if (own.axis == glm::vec3(0) || other.axis == glm::vec3(0))
    return {.axis = own.axis, .min_cosine = -1};
  const auto angle = [](double cosine) { return std::acos(std::clamp(cosine, -1.0, 1.0)); };
  const double between =
      angle(glm::dot(glm::normalize(glm::dvec3(own.axis)), glm::normalize(glm::dvec3(other.axis))));
  const double widest = std::min(between + angle(other.min_cosine), std::numbers::pi);
  const double cosine = std::cos(widest) - 1e-6;  // float must not round it inwards
  return {.axis = own.axis, .min_cosine = std::min(own.min_cosine, static_cast<float>(cosine))};
}

}  // namespace

LodTree::LodTree(const formats::Tree& tree, const formats::Grid& grid,
                 const std::vector<formats::NodeRecord>& records)
    : shape_(tree), fanout_(tree.fanout()) {
  CAIRN_CHECK(records.size() == tree.node_count());
  if (records.size() >= std::numeric_limits<NodeIndex>::max() / (fanout_ + 1))
    formats::throw_input({.what = "too many nodes to draw from",
                          .found = std::to_string(records.size()),
                          .expected = "fewer than 2^32 blocks"});
  first_leaf_ = static_cast<std::uint32_t>(formats::value_of(tree.id(tree.leaf_level(), 0)));
  nodes_.reserve(records.size());
  block_start_.reserve(records.size() * (fanout_ + 1));
  for (const formats::NodeRecord& record : records) {
    nodes_.push_back(lod_node(grid, record));
    block_start_.insert(block_start_.end(), record.block_start.begin(), record.block_start.end());
    node_points_ = std::max(node_points_, record.point_count);
  }
  const Box& scene = nodes_.front().box;
  // Boxes relative to the eye are floats in a renderer.
  if (!(glm::length(scene.half) < 1e30 && glm::length(scene.center) < 1e30))
    formats::throw_input({.what = "a dataset too large to draw",
                          .found = "coordinates beyond 1e30",
                          .expected = "coordinates below 1e30"});
  // A record's cone and radius are of the node's own points; those below it may lean and reach farther.
  for (NodeIndex node = size(); node-- > 1;) {
    LodNode& above = nodes_[parent(node)];
    above.cone = joined(above.cone, nodes_[node].cone);
    above.reach = std::max(above.reach, nodes_[node].reach);
  }
  // And a region is drawn by its parent's block, too.
  for (NodeIndex node = 1; node < size(); ++node)
    nodes_[node].reach = std::max(nodes_[node].reach, nodes_[parent(node)].radius_max);
}

}  // namespace cairn::viewer
