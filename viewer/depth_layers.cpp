#include "viewer/depth_layers.h"

#include <algorithm>
#include <array>
#include <glm/common.hpp>

namespace cairn::viewer {
namespace {

// Coarse cells are enough: what is asked is whether most of a picture hides something.
constexpr int kColumns = 64;
constexpr int kRows = 36;

struct Rectangle {
  glm::dvec2 least{1e300, 1e300};
  glm::dvec2 greatest{-1e300, -1e300};
};

/// The picture's rectangle around a box; all of the picture where the box reaches behind the eye.
Rectangle rectangle_of(const View& view, const Box& box) {
  if (view.nearest_depth(box) < view.near())
    return {{0, 0}, {view.size().width, view.size().height}};
  Rectangle rectangle;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 sign((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1,
                          (corner & 4) != 0 ? 1 : -1);
    const glm::dvec2 at = view.project(box.center + sign * box.half - view.eye());
    rectangle.least = glm::min(rectangle.least, at);
    rectangle.greatest = glm::max(rectangle.greatest, at);
  }
  return rectangle;
}

int cell(double at, std::uint32_t pixels, int cells) {
  return static_cast<int>(std::clamp(at / pixels * cells, 0.0, cells - 1.0));
}

}  // namespace

double depth_layers(const LodTree& tree, const View& view, const Selection& selection) {
  std::array<std::array<std::uint32_t, kColumns>, kRows> layers{};
  for (const FrontBlock& block : selection.front) {
    const Box& box = tree.node(tree.region_of(block.node, block.block)).box;
    const Rectangle r = rectangle_of(view, box);
    const PictureSize size = view.size();
    const int left = cell(r.least.x, size.width, kColumns);
    const int right = cell(r.greatest.x, size.width, kColumns);
    for (int y = cell(r.least.y, size.height, kRows); y <= cell(r.greatest.y, size.height, kRows);
         ++y)
      for (int x = left; x <= right; ++x) ++layers[y][x];
  }
  double sum = 0;
  double covered = 0;
  for (const auto& row : layers)
    for (const std::uint32_t count : row) {
      sum += count;
      if (count > 0) covered += 1;
    }
  return covered > 0 ? sum / covered : 0;
}

}  // namespace cairn::viewer
