#include "tests/support/pixel_error.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "formats/error.h"

namespace cairn::test {
namespace {

using formats::NodeData;
using viewer::NodeIndex;

constexpr NodeIndex kNone = std::numeric_limits<NodeIndex>::max();
/// A point this near to the picture's edge may be on either side of it by rounding.
constexpr double kEdgePixels = 1e-6;
/// Rounding of measured pixels.
constexpr double kRounding = 1e-9;

/// Where a point appears.
struct Spot {
  double x = 0, y = 0;  ///< pixels
  double depth = 0;     ///< world units
};

/// A pinhole camera by the textbook.
class Pinhole {
 public:
  explicit Pinhole(const viewer::View& view)
      : eye_(view.camera().eye),
        into_(glm::normalize(view.camera().target - eye_)),
        right_(glm::normalize(glm::cross(into_, view.camera().up))),
        down_(glm::cross(into_, right_)),
        width_(view.size().width),
        height_(view.size().height),
        near_(view.near()),
        focal_(height_ / (2 * std::tan(view.camera().fov_y_degrees * std::numbers::pi / 360))) {}

  Spot spot(const formats::WorldPoint& point) const {
    const glm::dvec3 from_eye = glm::dvec3(point[0], point[1], point[2]) - eye_;
    const double depth = glm::dot(from_eye, into_);
    return {width_ / 2 + focal_ * glm::dot(from_eye, right_) / depth,
            height_ / 2 + focal_ * glm::dot(from_eye, down_) / depth, depth};
  }
  bool before_near_plane(const Spot& spot) const { return spot.depth < near_; }
  bool in_picture(const Spot& spot) const {
    return !before_near_plane(spot) && spot.x > kEdgePixels && spot.x < width_ - kEdgePixels &&
           spot.y > kEdgePixels && spot.y < height_ - kEdgePixels;
  }

 private:
  glm::dvec3 eye_, into_, right_, down_;
  double width_, height_, near_, focal_;
};

/// Which node draws a leaf's region, and what that promises.
struct Drawer {
  formats::Level level = 0;
  double block_bound = 0;  ///< pixels
  double promise = 0;      ///< pixels
  unsigned found = 0;      ///< blocks that cover the region; 1 where all is right
};

class Walk {
 public:
  Walk(const formats::DatasetReader& dataset, const viewer::LodTree& tree, const viewer::View& view,
       std::span<const Cut> cuts)
      : dataset_(dataset),
        tree_(tree),
        view_(view),
        lens_(view),
        cuts_(cuts),
        chain_(tree.shape().leaf_level() + 1),
        drawers_(cuts.size()),
        result_(cuts.size()) {
    for (const Cut& cut : cuts) {
      std::vector<NodeIndex>& drawn_by = drawn_by_.emplace_back(tree.size(), kNone);
      for (const viewer::FrontBlock& block : cut.selection.front) {
        NodeIndex& drawer = drawn_by[tree.region_of(block.node, block.block)];
        CAIRN_CHECK(drawer == kNone);
        drawer = block.node;
      }
    }
  }

  std::vector<Displacement> run() {
    descend(0, 0);
    return std::move(result_);
  }

 private:
  struct Link {
    std::vector<Spot> spots;
    std::vector<std::uint32_t> representative;
  };

  void descend(NodeIndex node, formats::Level level) {
    formats::SectionSet wanted;
    wanted.set(formats::kPositionSection).set(formats::kRepresentativeSection);
    NodeData data = dataset_.read_node(formats::NodeId{node}, wanted);
    Link& link = chain_[level];
    link.spots.resize(data.count());
    for (std::size_t i = 0; i < data.count(); ++i)
      link.spots[i] = lens_.spot(dataset_.header().grid.world(data.position[i]));
    link.representative = std::move(data.representative);
    if (tree_.is_leaf(node)) return measure(node);
    for (std::uint32_t block = 0; block < tree_.fanout(); ++block)
      descend(tree_.child(node, block), level + 1);
  }

  Drawer find_drawer(std::size_t cut, NodeIndex leaf) const {
    Drawer found;
    for (NodeIndex region = leaf;; region = tree_.parent(region)) {
      if (const NodeIndex drawer = drawn_by_[cut][region]; drawer != kNone) {
        ++found.found;
        found.level = tree_.level_of(drawer);
        found.block_bound = view_.pixel_bound(tree_.node(region).box, tree_.node(drawer).bound);
        found.promise = std::min(found.block_bound, cuts_[cut].selection.pixel_bound);
        if (!tree_.is_leaf(drawer)) found.promise = std::min(found.promise, cuts_[cut].pixel_error);
      }
      if (region == 0) return found;
    }
  }

  void measure(NodeIndex leaf) {
    for (std::size_t cut = 0; cut < cuts_.size(); ++cut) drawers_[cut] = find_drawer(cut, leaf);
    const viewer::LodNode& node = tree_.node(leaf);
    const double own = view_.pixel_bound(node.box, node.bound);
    std::vector<std::uint32_t> at(chain_.size());  // the point that stands for it on each level
    for (std::uint32_t i = 0; i < chain_.back().spots.size(); ++i) {
      const Spot& spot = chain_.back().spots[i];
      if (!lens_.in_picture(spot)) continue;
      at.back() = i;
      for (std::size_t level = chain_.size() - 1; level > 0; --level)
        at[level - 1] = chain_[level].representative[at[level]];
      for (std::size_t cut = 0; cut < cuts_.size(); ++cut) {
        const Drawer& drawer = drawers_[cut];
        add(result_[cut], drawer, own, spot, chain_[drawer.level].spots[at[drawer.level]]);
      }
    }
  }

  void add(Displacement& sums, const Drawer& drawer, double own, const Spot& belongs,
           const Spot& drawn) const {
    if (drawer.found == 0) {
      ++sums.uncovered;
      return;
    }
    ++sums.points;
    if (drawer.found > 1) ++sums.covered_twice;
    if (lens_.before_near_plane(drawn)) {
      ++sums.lost;
      if (std::isfinite(drawer.promise)) ++sums.above;
      return;
    }
    const double pixels = std::hypot(drawn.x - belongs.x, drawn.y - belongs.y);
    sums.max = std::max(sums.max, pixels);
    sums.sum += pixels;
    sums.sum_squares += pixels * pixels;
    if (pixels > 0) sums.worst_share = std::max(sums.worst_share, pixels / drawer.block_bound);
    if (pixels > drawer.promise + (pixels > 0 ? own : 0) + kRounding) ++sums.above;
  }

  const formats::DatasetReader& dataset_;
  const viewer::LodTree& tree_;
  const viewer::View& view_;
  Pinhole lens_;
  std::span<const Cut> cuts_;
  std::vector<std::vector<NodeIndex>> drawn_by_;  ///< for each cut, the node that draws a region
  std::vector<Link> chain_;                       ///< from the root to the node at hand
  std::vector<Drawer> drawers_;                   ///< of the leaf at hand, one a cut
  std::vector<Displacement> result_;
};

}  // namespace

double Displacement::mean() const {
  return points > lost ? sum / static_cast<double>(points - lost) : 0;
}

double Displacement::rms() const {
  return points > lost ? std::sqrt(sum_squares / static_cast<double>(points - lost)) : 0;
}

std::vector<Displacement> measure_displacement(const formats::DatasetReader& dataset,
                                               const viewer::LodTree& tree,
                                               const viewer::View& view,
                                               std::span<const Cut> cuts) {
  return Walk(dataset, tree, view, cuts).run();
}

}  // namespace cairn::test
