#include "stages/measure/surface_error.h"

#include <cmath>
#include <limits>
#include <mutex>

#include "stages/measure/cover.h"
#include "stages/measure/deviation.h"
#include "stages/measure/nearest_splats.h"
#include "stages/parallel.h"

namespace cairn::stages {
namespace {

using formats::DatasetReader;
using formats::GridPoint;
using formats::Level;

/// What the points of a batch add to a level. Sums of doubles are put together in the order of the batches.
struct SurfaceSums {
  Deviation nearest, splat;
};

/// What depends on no order.
struct SurfaceCounts {
  DeviationHistogram nearest, splat, needs;  ///< of needs those that are finite
  double largest_need = 0;                   ///< squared
  std::uint64_t finite_needs = 0, covered = 0, covering = 0;

  void add(const SurfaceCounts& other) {
    nearest.add(other.nearest);
    splat.add(other.splat);
    needs.add(other.needs);
    largest_need = std::max(largest_need, other.largest_need);
    finite_needs += other.finite_needs;
    covered += other.covered;
    covering += other.covering;
  }
};

class SurfaceMeasure {
 public:
  SurfaceMeasure(const Context& context, const DatasetReader& dataset, Level end, SplatCache& cache)
      : context_(context), dataset_(dataset), cache_(cache), counts_(end) {
    for (Level level = 0; level < end; ++level) levels_.emplace_back(dataset, level);
  }

  std::vector<SurfaceError> run(const PointSample& points) {
    std::vector<std::vector<SurfaceSums>> sums(points.batches);
    for_each_piece(points.batches, [&](std::uint64_t batch) {
      const std::vector<GridPoint> some = points.batch(batch);
      for (const SearchedLevel& level : levels_) sums[batch].push_back(compare(some, level));
      if (context_.progress != nullptr) context_.progress->advance(some.size());
    });
    std::vector<SurfaceError> errors;
    for (Level level = 0; level < levels_.size(); ++level) {
      SurfaceSums total;
      for (const std::vector<SurfaceSums>& batch : sums) {
        total.nearest.add(batch[level].nearest);
        total.splat.add(batch[level].splat);
      }
      errors.push_back(error_of(total, counts_[level], points.is_all));
    }
    return errors;
  }

 private:
  SurfaceSums compare(const std::vector<GridPoint>& points, const SearchedLevel& level) {
    throw_if_stopped(context_);
    LevelSearch search(dataset_, level, cache_);
    SurfaceSums sums;
    SurfaceCounts counts;
    for (const GridPoint& point : points)
      add_cover(point, add_nearest(point, search, sums, counts), search, counts);
    const std::lock_guard lock(mutex_);
    counts_[level.level()].add(counts);
    return sums;
  }

  /// Returns the least need of the nearest splats, squared.
  double add_nearest(const GridPoint& point, LevelSearch& search, SurfaceSums& sums,
                     SurfaceCounts& counts) const {
    NearestSplats near;
    search.search(point, near);
    double least = std::numeric_limits<double>::infinity(), need = least;
    for (const NearestSplats::Found& found : near.found()) {
      least = std::min(least, distance_to(found.splat, dataset_.header().grid.step, point));
      need = std::min(
          need, squared_need(found.squared_distance, static_cast<double>(found.splat.radius)));
    }
    const double square = near.found().front().squared_distance;
    sums.nearest.add(square);
    counts.nearest.add(square);
    sums.splat.add(least * least);
    counts.splat.add(least * least);
    return need;
  }

  static void add_cover(const GridPoint& point, double need, LevelSearch& search,
                        SurfaceCounts& counts) {
    CoverSearch cover(need);
    search.search(point, cover);
    counts.covered += cover.covering() > 0 ? 1 : 0;
    counts.covering += cover.covering();
    counts.largest_need = std::max(counts.largest_need, cover.squared_need());
    if (!std::isfinite(cover.squared_need())) return;
    ++counts.finite_needs;
    counts.needs.add(cover.squared_need());
  }

  static SurfaceError error_of(const SurfaceSums& sums, const SurfaceCounts& counts, bool is_all) {
    const std::uint64_t sampled = sums.nearest.count();
    SurfaceError error{.sampled = sampled,
                       .nearest = distance_error(sums.nearest, counts.nearest, is_all),
                       .splat = distance_error(sums.splat, counts.splat, is_all)};
    if (sampled == 0) return error;
    const auto count = static_cast<double>(sampled);
    error.uncovered = static_cast<double>(sampled - counts.covered) / count;
    if (!is_all) error.uncovered_interval = share_interval(sampled - counts.covered, sampled);
    error.overdraw = static_cast<double>(counts.covering) / count;
    error.factor_all = std::sqrt(counts.largest_need);
    // Needs that no factor meets rank behind all others.
    const double share = 0.999 * count / static_cast<double>(counts.finite_needs);
    error.factor_99_9 = share > 1 ? std::numeric_limits<double>::infinity()
                                  : std::min(counts.needs.quantile(share), error.factor_all);
    return error;
  }

  const Context& context_;
  const DatasetReader& dataset_;
  SplatCache& cache_;
  std::vector<SearchedLevel> levels_;
  std::mutex mutex_;
  std::vector<SurfaceCounts> counts_;  ///< by level
};

}  // namespace

std::vector<SurfaceError> measure_surfaces(const Context& context, const DatasetReader& dataset,
                                           const PointSample& points, Level end,
                                           SplatCache& cache) {
  return SurfaceMeasure(context, dataset, end, cache).run(points);
}

}  // namespace cairn::stages
