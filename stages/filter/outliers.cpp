// Removal of points whose neighbors are unusually far away.
// Based on: R. B. Rusu, Z. C. Marton, N. Blodow, M. Dolha, M. Beetz, "Towards 3D Point Cloud Based Object Maps for
// Household Environments", 2008, and PCL's StatisticalOutlierRemoval. Departs from PCL in that neighbors are distinct
// positions, found exactly in double precision and over the whole campaign: copies of a stray point do not keep each
// other.
#include <algorithm>
#include <cmath>
#include <limits>

#include "stages/filter/effect.h"
#include "stages/neighbors/distinct_positions.h"
#include "stages/neighbors/leaf_boxes.h"
#include "stages/neighbors/neighborhoods.h"
#include "stages/parallel.h"

namespace cairn::stages {

namespace {

float rounded(double distance) {
  return static_cast<float>(std::min(distance, double{std::numeric_limits<float>::max()}));
}

/// Over the others of a neighborhood, the position itself being the first; 0 where there are none.
float mean_distance(std::span<const Neighbor> neighbors) {
  if (neighbors.size() < 2) return 0;
  double sum = 0;
  for (const Neighbor& neighbor : neighbors) sum += std::sqrt(neighbor.squared_distance);
  return rounded(sum / static_cast<double>(neighbors.size() - 1));
}

class OutlierRemoval final : public Effect {
 public:
  OutlierRemoval(double deviations, std::uint32_t neighbors)
      : deviations_(deviations), neighbors_(neighbors) {}
  std::string_view name() const override { return "outliers"; }

  void act(Cloud& cloud, std::uint8_t mark, Context& context) const override {
    const std::uint64_t points = cloud.leaves.tree().points();
    formats::ExternalArray distances = context.make_array("distances", points * sizeof(float));
    run_in_arena(workers_within(context, worker_bytes(cloud)), [&] {
      measure(cloud, distances, context);
      const float most = threshold(cloud, distances);
      for_each_piece(cloud.leaves.leaves(), [&](std::uint64_t leaf) {
        cloud.for_each_kept(leaf, [&](std::uint64_t point, const std::byte*) {
          if (distance_of(distances, point) > most) cloud.mark(point, mark);
        });
        release(cloud, distances, leaf);
      });
    });
    distances.remove();
  }

 private:
  /// The mean distance of every point to its neighbors. Only duplicates are removed before, which leaves the positions
  /// as they were.
  void measure(Cloud& cloud, formats::ExternalArray& distances, const Context& context) const {
    const LeafBoxes boxes(cloud.leaves.tree(), cloud.grid.step, cloud.boxes);
    const NeighborhoodFinder finder(cloud.leaves.array(), cloud.leaves.stride(), boxes,
                                    neighbors_ + std::size_t{1});
    for_each_piece(cloud.leaves.leaves(), [&](std::uint64_t leaf) {
      throw_if_stopped(context);
      const DistinctPositions distinct(cloud.leaves.of(leaf), cloud.leaves.stride(),
                                       cloud.boxes[leaf]);
      std::vector<float> means(distinct.positions.size());
      finder.find(leaf, distinct, [&](std::size_t i, std::span<const Neighbor> neighbors) {
        means[i] = mean_distance(neighbors);
      });
      const formats::IndexRange range = cloud.leaves.range_of(leaf);
      for (std::uint64_t i = 0; i < range.count; ++i)
        formats::store_le(distances.bytes().data() + (range.first + i) * sizeof(float),
                          means[distinct.of_record[i]]);
      release(cloud, distances, leaf);
      context.progress->advance(range.count);
    });
  }

  /// The mean of all distances and the deviations asked for, rounded as they are: where all are equal, rounding of the
  /// sums makes none an outlier.
  float threshold(Cloud& cloud, formats::ExternalArray& distances) const {
    const auto [points, sum] = sum_of(cloud, distances, [](double distance) { return distance; });
    const double mean = sum / points;
    const auto [same, squares] = sum_of(
        cloud, distances, [&](double distance) { return (distance - mean) * (distance - mean); });
    const double deviation = std::sqrt(squares / std::max(1.0, same - 1));
    return rounded(mean + deviations_ * deviation);
  }

  struct Sum {
    double points = 0;
    double value = 0;
  };

  /// Leaves are added up in their order.
  template <typename Value>
  Sum sum_of(Cloud& cloud, formats::ExternalArray& distances, Value value) const {
    std::vector<Sum> sums(cloud.leaves.leaves());
    for_each_piece(sums.size(), [&](std::uint64_t leaf) {
      cloud.for_each_kept(leaf, [&](std::uint64_t point, const std::byte*) {
        sums[leaf].points += 1;
        sums[leaf].value += value(static_cast<double>(distance_of(distances, point)));
      });
      release(cloud, distances, leaf);
    });
    Sum all;
    for (const Sum& sum : sums) all = {all.points + sum.points, all.value + sum.value};
    return all;
  }

  static float distance_of(const formats::ExternalArray& distances, std::uint64_t point) {
    return formats::load_le<float>(distances.bytes().data() + point * sizeof(float));
  }

  static void release(Cloud& cloud, formats::ExternalArray& distances, std::uint64_t leaf) {
    const formats::IndexRange range = cloud.leaves.range_of(leaf);
    cloud.release(leaf);
    distances.release(range.first * sizeof(float), range.count * sizeof(float));
  }

  std::uint64_t worker_bytes(const Cloud& cloud) const {
    const std::uint64_t points = cloud.leaves.tree().node_points();
    return points * (2 * sizeof(formats::GridPoint) + 16 + 4 + 2 * sizeof(float) + 1 +
                     cloud.leaves.stride()) +
           NeighborhoodFinder::find_bytes(points, neighbors_ + std::size_t{1});
  }

  double deviations_;
  std::uint32_t neighbors_;
};

}  // namespace

std::unique_ptr<Effect> make_outlier_removal(double deviations, std::uint32_t neighbors) {
  return std::make_unique<OutlierRemoval>(deviations, neighbors);
}

}  // namespace cairn::stages
