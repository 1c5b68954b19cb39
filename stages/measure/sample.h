// Which points are measured where not all are: chosen by a hash, so that the choice follows from the dataset or the
// scans alone, and not from the order in which threads come to them.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "stages/context.h"
#include "stages/record_stream.h"

namespace cairn::stages {

/// Takes each of `total` things (at least one) with the probability wanted / total; all if as many are wanted.
class Chooser {
 public:
  Chooser(std::uint64_t wanted, std::uint64_t total);
  bool takes_all() const { return all_; }
  /// `hash` is evenly distributed.
  bool takes(std::uint64_t hash) const { return all_ || hash < threshold_; }
  /// Of the points of a node those that are taken, by their number in the node.
  std::vector<formats::GridPoint> taken_of(formats::NodeId id,
                                           std::vector<formats::GridPoint> points) const;

 private:
  bool all_;
  std::uint64_t threshold_ = 0;
};

/// Points in batches, each of points that lie close together.
struct PointSample {
  bool is_all = false;
  std::uint64_t points = 0;  ///< to be expected, a few more or less
  std::uint64_t batches = 0;
  std::function<std::vector<formats::GridPoint>(std::uint64_t batch)> batch;  ///< from any thread
};

/// About `wanted` of the points that a level stores, a node a batch, read when a batch is asked for. `dataset` must
/// outlive the sample.
PointSample sample_of_level(const formats::DatasetReader& dataset, formats::Level level,
                            std::uint64_t wanted);

/// About `wanted` of the points of the scans, on the dataset's grid, by a hash of their records: of records that are
/// equal in all, all are taken or none. Those that effects removed are among them. Held in memory, 56 bytes a point while
/// they are sorted, 12 then; throws Error (kUsage) where that is more than a quarter of the context's.
PointSample sample_of_scans(const Context& context, const formats::DatasetReader& dataset,
                            const RecordSource& scans, std::uint64_t wanted);

}  // namespace cairn::stages
