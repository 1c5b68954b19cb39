#include "tests/support/random_tree.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace cairn::tests {
namespace {

using formats::GridBox;
using formats::NodeRecord;
using formats::Tree;

std::int32_t integer_in(std::int32_t least, std::int32_t greatest, std::mt19937_64& random) {
  return std::uniform_int_distribution(least, greatest)(random);
}

/// Part of the parent's box: along its longest axis about where the child's share lies, otherwise at random.
GridBox random_box_within(const GridBox& parent, std::uint64_t child, std::uint32_t fanout,
                          std::mt19937_64& random) {
  GridBox box = parent;
  int longest = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (parent.span(axis) > parent.span(longest)) longest = axis;
  for (int axis = 0; axis < 3; ++axis) {
    const auto span = static_cast<std::int32_t>(parent.span(axis));
    if (axis == longest) {
      box.min[axis] = parent.min[axis] + static_cast<std::int32_t>(span * child / fanout);
      box.max[axis] = parent.min[axis] + static_cast<std::int32_t>(span * (child + 1) / fanout);
    } else if (random() % 2 == 0) {
      box.min[axis] += integer_in(0, span / 4, random);
      box.max[axis] -= integer_in(0, span / 4, random);
    }
  }
  return box;
}

void set_blocks(const Tree& tree, NodeRecord& record) {
  record.block_start.assign(tree.fanout() + 1, record.point_count);
  record.block_start[0] = 0;
  if (tree.is_leaf(record.id)) return;
  const auto first = formats::value_of(tree.first_child(record.id));
  for (std::uint32_t block = 0; block < tree.fanout(); ++block)
    record.block_start[block] =
        static_cast<std::uint32_t>(tree.quota_start(formats::NodeId{first + block}));
}

formats::NormalCone random_cone(std::mt19937_64& random) {
  std::normal_distribution<float> normal;
  const glm::vec3 axis = glm::normalize(glm::vec3(normal(random), normal(random), normal(random)));
  return {{axis.x, axis.y, axis.z}, std::uniform_real_distribution<float>(0.5f, 1.0f)(random)};
}

}  // namespace

viewer::LodTree make_random_tree(const RandomTreeShape& shape, std::mt19937_64& random) {
  const Tree tree(shape.points, shape.fanout, shape.target_points);
  std::vector<NodeRecord> records(tree.node_count());
  for (std::uint64_t i = 0; i < records.size(); ++i) {
    NodeRecord& record = records[i];
    record.id = formats::NodeId{i};
    record.point_count = static_cast<std::uint32_t>(tree.stored_points(record.id));
    set_blocks(tree, record);
    const double share = std::uniform_real_distribution(0.02, 0.2)(random);
    if (i == 0) {
      record.box.min = {-100'000, -80'000, -30'000};
      record.box.max = {100'000, 80'000, 30'000};
    } else {
      const std::uint64_t child = (i - 1) % shape.fanout;
      record.box = random_box_within(records[formats::value_of(tree.parent(record.id))].box, child,
                                     shape.fanout, random);
    }
    record.bound = tree.is_leaf(record.id) ? 0 : share * record.box.span(0) * 0.001;
    record.radius_max = static_cast<float>(record.bound / 2);
    if (shape.cones) record.cone = random_cone(random);
  }
  const formats::Grid grid{.step = {0.001, 0.001, 0.001}, .offset = {5e5, 4e6, 100}, .shift = {}};
  return {tree, grid, records};
}

viewer::Camera random_camera(const viewer::Box& scene, std::mt19937_64& random) {
  const auto point = [&](double reach) {
    glm::dvec3 at = scene.center;
    for (int axis = 0; axis < 3; ++axis)
      at[axis] += std::uniform_real_distribution(-reach, reach)(random) * scene.half[axis];
    return at;
  };
  viewer::Camera camera;
  camera.eye = point(2.5);
  camera.target = point(1);
  camera.fov_y_degrees = std::uniform_real_distribution(15.0, 100.0)(random);
  return camera;
}

std::uint32_t times_covered(const viewer::LodTree& tree, const viewer::Selection& cut,
                            viewer::NodeIndex leaf) {
  const auto in_front = [&](viewer::NodeIndex node, std::uint32_t block) {
    return std::ranges::any_of(cut.front, [&](const viewer::FrontBlock& entry) {
      return entry.node == node && entry.block == block;
    });
  };
  std::uint32_t times = in_front(leaf, 0) ? 1 : 0;
  for (viewer::NodeIndex region = leaf; region != 0; region = tree.parent(region))
    if (in_front(tree.parent(region), (region - 1) % tree.fanout())) ++times;
  return times;
}

bool is_visible(const viewer::LodTree& tree, const viewer::View& view, bool cull_back_faces,
                viewer::NodeIndex leaf) {
  for (viewer::NodeIndex region = leaf;; region = tree.parent(region)) {
    const viewer::LodNode& node = tree.node(region);
    if (!view.may_see(node.box, node.reach)) return false;
    if (cull_back_faces && view.faces_away(node.box, node.cone)) return false;
    if (region == 0) return true;
  }
}

}  // namespace cairn::tests
