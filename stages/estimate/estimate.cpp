#include "stages/estimate/estimate.h"

#include <atomic>
#include <cstring>
#include <utility>

#include "formats/bytes.h"
#include "formats/checksum.h"
#include "formats/error.h"
#include "stages/estimate/surface.h"
#include "stages/neighbors/distinct_positions.h"
#include "stages/neighbors/leaf_boxes.h"
#include "stages/neighbors/leaf_records.h"
#include "stages/neighbors/neighborhoods.h"
#include "stages/parallel.h"
#include "stages/unit_state.h"

namespace cairn::stages {

using formats::GridBox;
using formats::GridPoint;
using formats::IndexRange;

namespace {

constexpr std::size_t kNumberBytes = sizeof(std::uint32_t);

/// The units are groups of leaves, one after the other.
constexpr std::string_view kUnits = unit_log::kEstimate;
constexpr std::uint64_t kMostUnits = 1024;

struct Estimated {
  NormalVector normal{};
  float radius = 0;
};

class Estimator {
 public:
  Estimator(const EstimateInput& input, const EstimateOptions& options, EstimatedPoints& output,
            bool again, const Context& context)
      : in_(input),
        leaves_(input.records, input.stride, input.tree),
        options_(options),
        out_(output),
        again_(again),
        context_(context) {}

  void run() {
    const LeafBoxes boxes(in_.tree, in_.grid.step, leaves_.boxes(context_));
    const NeighborhoodFinder finder(in_.records, in_.stride, boxes, options_.neighbors);
    for_each_piece(units(), [&](std::uint64_t unit) {
      if (is_done(unit)) return context_.progress->advance(points_of(unit).count);
      const IndexRange group = leaves_of(unit);
      for_each_piece(group.count, [&](std::uint64_t i) {
        const std::uint64_t leaf = group.first + i;
        estimate_leaf(leaf, boxes.leaf(leaf), finder);
      });
      finish_unit(context_, kUnits, unit, StateWriter().put(checksum_of(unit)).bytes());
    });
  }

  /// Whether an earlier run has estimated all, and it is still there.
  bool all_done() {
    std::atomic<bool> all = finished_unit(context_, kUnits, kStageDone).has_value();
    if (all)
      for_each_piece(units(), [&](std::uint64_t unit) {
        if (!is_done(unit)) all = false;
      });
    return all;
  }

 private:
  std::uint64_t units() const { return std::min(leaves_.leaves(), kMostUnits); }
  IndexRange leaves_of(std::uint64_t unit) const {
    const std::uint64_t first = unit * leaves_.leaves() / units();
    return {first, (unit + 1) * leaves_.leaves() / units() - first};
  }
  IndexRange points_of(std::uint64_t unit) const {
    const IndexRange group = leaves_of(unit);
    const std::uint64_t first = leaves_.range_of(group.first).first;
    return {first, leaves_.range_of(group.end() - 1).end() - first};
  }
  std::uint64_t checksum_of(std::uint64_t unit) const {
    const IndexRange points = points_of(unit);
    const std::uint64_t at = points.first * out_.stride, size_bytes = points.count * out_.stride;
    const std::uint64_t checksum = formats::checksum_of(out_.array.bytes().subspan(at, size_bytes));
    out_.array.release(at, size_bytes);
    return checksum;
  }
  bool is_done(std::uint64_t unit) const {
    const auto state = again_ ? finished_unit(context_, kUnits, unit) : std::nullopt;
    if (!state) return false;
    std::uint64_t checksum = 0;
    StateReader(*state).get(checksum);
    return checksum == checksum_of(unit);
  }

  void estimate_leaf(std::uint64_t leaf, const GridBox& box, const NeighborhoodFinder& finder) {
    throw_if_stopped(context_);
    const DistinctPositions points(leaves_.of(leaf), in_.stride, box);
    std::vector<Estimated> estimated(points.positions.size());
    finder.find(leaf, points, [&](std::size_t i, std::span<const Neighbor> neighbors) {
      if (options_.normals) estimated[i].normal = plane_normal(in_.grid, neighbors);
      if (options_.radii) estimated[i].radius = splat_radius(in_.grid, neighbors);
    });
    write(leaf, points, estimated);
    leaves_.release(leaf);
    context_.progress->advance(leaves_.range_of(leaf).count);
  }

  void write(std::uint64_t leaf, const DistinctPositions& points,
             const std::vector<Estimated>& estimated) {
    const IndexRange range = leaves_.range_of(leaf);
    const std::size_t kept_bytes = in_.stride - (in_.numbered ? kNumberBytes : 0);
    const std::byte* from = leaves_.of(leaf).data();
    std::byte* to = out_.array.bytes().data() + range.first * out_.stride;
    for (std::size_t i = 0; i < range.count; ++i, from += in_.stride, to += out_.stride) {
      std::memcpy(to, from, kept_bytes);
      const std::size_t point = points.of_record[i];
      std::byte* column = to + kept_bytes;
      if (options_.normals) {
        const std::size_t scan =
            in_.numbered ? formats::load_le<std::uint32_t>(from + kept_bytes) : 0;
        const NormalVector normal =
            turned(estimated[point].normal, in_.grid.world(points.positions[point]),
                   scan < in_.sensors.size() ? in_.sensors[scan] : std::nullopt);
        std::memcpy(column, normal.data(), sizeof normal);
        column += sizeof normal;
      }
      if (options_.radii) formats::store_le(column, estimated[point].radius);
    }
    out_.array.release(range.first * out_.stride, range.count * out_.stride);
  }

  const EstimateInput& in_;
  LeafRecords leaves_;
  const EstimateOptions& options_;
  EstimatedPoints& out_;
  bool again_;  ///< an earlier run has left work in the output
  const Context& context_;
};

/// What one worker holds: a leaf's positions with their order, what is estimated, the search, and its
/// records in both arrays.
std::uint64_t worker_bytes(const EstimateInput& input, const EstimateOptions& options,
                           std::size_t stride_out) {
  const std::uint64_t points = input.tree.node_points();
  return points *
             (2 * sizeof(GridPoint) + 16 + 4 + sizeof(Estimated) + 2 * input.stride + stride_out) +
         NeighborhoodFinder::find_bytes(points, options.neighbors);
}

}  // namespace

std::size_t estimated_stride(std::size_t stride, bool numbered, const EstimateOptions& options) {
  return stride - (numbered ? kNumberBytes : 0) + (options.normals ? sizeof(NormalVector) : 0) +
         (options.radii ? sizeof(float) : 0);
}

EstimatedPoints estimate(const EstimateInput& input, const EstimateOptions& options,
                         Context& context) {
  CAIRN_CHECK(options.neighbors >= 3);
  EstimatedPoints output;
  output.stride = estimated_stride(input.stride, input.numbered, options);
  const std::uint64_t size_bytes = input.tree.points() * output.stride;
  auto found = find_array(context, "estimate", size_bytes);
  const bool again = found.has_value();
  output.array = again ? std::move(*found) : context.make_array("estimate", size_bytes);
  context.progress->begin("estimate", input.tree.points());
  run_in_arena(workers_within(context, worker_bytes(input, options, output.stride)), [&] {
    Estimator estimator(input, options, output, again, context);
    if (estimator.all_done()) return context.progress->advance(input.tree.points());
    if (input.records.size_bytes() == 0) throw WorkLost{};
    estimator.run();
    finish_unit(context, kUnits, kStageDone, {});
  });
  context.progress->end();
  return output;
}

}  // namespace cairn::stages
