#include "stages/measure/spacing_error.h"

#include <cmath>
#include <mutex>
#include <vector>

#include "stages/measure/deviation.h"
#include "stages/measure/nearest_splats.h"
#include "stages/measure/sample.h"
#include "stages/parallel.h"

namespace cairn::stages {
namespace {

using formats::GridPoint;

/// Number, mean and sum of squared deviations from the mean, which do not suffer where these are small. Based on:
/// Tony F. Chan, Gene H. Golub, Randall J. LeVeque, "Algorithms for computing the sample variance", The American
/// Statistician 37(3), 1983: the update of two samples' sums.
struct Spread {
  double count = 0, mean = 0, squares = 0;

  void add(double value) { add({1, value, 0}); }
  void add(const Spread& later) {
    if (later.count == 0) return;
    const double all = count + later.count, apart = later.mean - mean;
    squares += later.squares + apart * apart * count * later.count / all;
    mean += apart * later.count / all;
    count = all;
  }
};

struct StoredSums {
  Spread spacing;
  Deviation truth;
};

}  // namespace

GeometryError measure_stored(
    const Context& context, const formats::DatasetReader& dataset, formats::Level level,
    std::uint64_t wanted, SplatCache& cache,
    const std::function<double(const formats::WorldPoint&)>& true_distance) {
  const PointSample points = sample_of_level(dataset, level, wanted);
  const SearchedLevel searched(dataset, level);
  std::vector<StoredSums> sums(points.batches);
  std::mutex mutex;
  DeviationHistogram truth;
  for_each_piece(points.batches, [&](std::uint64_t batch) {
    throw_if_stopped(context);
    const std::vector<GridPoint> some = points.batch(batch);
    LevelSearch search(dataset, searched, cache);
    DeviationHistogram distances;
    for (const GridPoint& point : some) {
      NearestOther other;
      search.search(point, other);
      if (std::isfinite(other.squared_distance()))
        sums[batch].spacing.add(std::sqrt(other.squared_distance()));
      if (!true_distance) continue;
      const double distance = true_distance(dataset.header().grid.world(point));
      sums[batch].truth.add(distance * distance);
      distances.add(distance * distance);
    }
    if (context.progress != nullptr) context.progress->advance(some.size());
    const std::lock_guard lock(mutex);
    truth.add(distances);
  });
  StoredSums total;
  for (const StoredSums& batch : sums) {
    total.spacing.add(batch.spacing);
    total.truth.add(batch.truth);
  }
  GeometryError error;
  const Spread& spacing = total.spacing;
  if (spacing.count > 0)
    error.spacing = {.sampled = static_cast<std::uint64_t>(spacing.count),
                     .mean = spacing.mean,
                     .variation = std::sqrt(spacing.squares / spacing.count) / spacing.mean};
  if (true_distance) error.truth = distance_error(total.truth, truth, points.is_all);
  return error;
}

}  // namespace cairn::stages
