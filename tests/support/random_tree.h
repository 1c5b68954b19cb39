// Trees with random boxes, errors and cones for the tests of the viewer: no file, no points.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "formats/dataset/node_record.h"
#include "formats/dataset/tree.h"
#include "viewer/lod_selection.h"

namespace cairn::tests {

struct RandomTreeShape {
  std::uint64_t points = 20000;
  std::uint32_t fanout = 4;
  std::uint64_t target_points = 300;
  bool cones = false;
};

/// Boxes are nested as an index promises: a child's within its parent's. They may overlap and leave room.
viewer::LodTree make_random_tree(const RandomTreeShape& shape, std::mt19937_64& random);

/// A camera somewhere around or in the box, looking at some point of it.
viewer::Camera random_camera(const viewer::Box& scene, std::mt19937_64& random);

/// How many blocks of a front stand for the region of `leaf`: 1 if it is covered just once.
std::uint32_t times_covered(const viewer::LodTree& tree, const viewer::Selection& cut,
                            viewer::NodeIndex leaf);
/// Whether no region from the root to the leaf is culled.
bool is_visible(const viewer::LodTree& tree, const viewer::View& view, bool cull_back_faces,
                viewer::NodeIndex leaf);

}  // namespace cairn::tests
