// Reads the leaves of a dataset with nothing but what Cairn installs, and prints: nodes, points, and the corners of the
// box of their positions in world coordinates.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <limits>

#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"

int main(int argc, char** argv) try {
  using namespace cairn::formats;
  if (argc != 2) return 2;
  const DatasetReader dataset = DatasetReader::open(argv[1]);
  const Tree& tree = dataset.tree();
  std::uint64_t points = 0;
  WorldPoint low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (std::uint64_t leaf = 0; leaf < tree.nodes_on(tree.leaf_level()); ++leaf) {
    const NodeData node = dataset.read_node(tree.id(tree.leaf_level(), leaf), all_sections());
    points += node.count();
    for (const GridPoint& point : node.position) {
      const WorldPoint world = dataset.header().grid.world(point);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], world[axis]);
        high[axis] = std::max(high[axis], world[axis]);
      }
    }
  }
  std::printf("%llu nodes, %llu points, from %.17g %.17g %.17g to %.17g %.17g %.17g\n",
              static_cast<unsigned long long>(tree.node_count()),
              static_cast<unsigned long long>(points), low[0], low[1], low[2], high[0], high[1],
              high[2]);
  return 0;
} catch (const cairn::formats::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return static_cast<int>(error.kind());
}
