#include "stages/estimate/estimate.h"

#include <cstring>
#include <utility>

#include "formats/bytes.h"
#include "formats/error.h"
#include "stages/estimate/distinct_positions.h"
#include "stages/estimate/leaf_boxes.h"
#include "stages/estimate/neighborhoods.h"
#include "stages/estimate/surface.h"
#include "stages/parallel.h"

namespace cairn::stages {

using formats::GridBox;
using formats::GridPoint;
using formats::IndexRange;

namespace {

constexpr std::size_t kNumberBytes = sizeof(std::uint32_t);

struct Estimated {
  NormalVector normal{};
  float radius = 0;
};

class Estimator {
 public:
  Estimator(const EstimateInput& input, const EstimateOptions& options, EstimatedPoints& output,
            const Context& context)
      : in_(input), options_(options), out_(output), context_(context) {}

  void run() {
    const std::uint64_t leaves = in_.tree.nodes_on(in_.tree.leaf_level());
    std::vector<GridBox> leaf_boxes(leaves);
    for_each_piece(leaves, [&](std::uint64_t leaf) { leaf_boxes[leaf] = box_of(leaf); });
    const LeafBoxes boxes(in_.tree, in_.grid.step, std::move(leaf_boxes));
    const NeighborhoodFinder finder(in_.records, in_.stride, boxes, options_.neighbors);
    for_each_piece(leaves,
                   [&](std::uint64_t leaf) { estimate_leaf(leaf, boxes.leaf(leaf), finder); });
  }

 private:
  IndexRange range_of(std::uint64_t leaf) const {
    return in_.tree.input_range(in_.tree.leaf_level(), leaf);
  }
  std::span<const std::byte> records_of(std::uint64_t leaf) const {
    const IndexRange range = range_of(leaf);
    return std::as_const(in_.records)
        .bytes()
        .subspan(range.first * in_.stride, range.count * in_.stride);
  }
  void release(std::uint64_t leaf) const {
    const IndexRange range = range_of(leaf);
    in_.records.release(range.first * in_.stride, range.count * in_.stride);
  }

  GridBox box_of(std::uint64_t leaf) const {
    throw_if_stopped(context_);
    const auto records = records_of(leaf);
    GridBox box;
    for (std::size_t at = 0; at < records.size(); at += in_.stride) {
      GridPoint position;
      std::memcpy(position.data(), records.data() + at, sizeof position);
      box.add(position);
    }
    release(leaf);
    return box;
  }

  void estimate_leaf(std::uint64_t leaf, const GridBox& box, const NeighborhoodFinder& finder) {
    throw_if_stopped(context_);
    const DistinctPositions points(records_of(leaf), in_.stride, box);
    std::vector<Estimated> estimated(points.positions.size());
    PlaneFitter fitter(in_.grid);
    finder.find(leaf, points, [&](std::size_t i, std::span<const Neighbor> neighbors) {
      if (options_.normals) estimated[i].normal = fitter.normal(neighbors);
      if (options_.radii) estimated[i].radius = splat_radius(in_.grid, neighbors);
    });
    write(leaf, points, estimated);
    release(leaf);
    context_.progress->advance(range_of(leaf).count);
  }

  void write(std::uint64_t leaf, const DistinctPositions& points,
             const std::vector<Estimated>& estimated) {
    const IndexRange range = range_of(leaf);
    const std::size_t kept_bytes = in_.stride - (in_.numbered ? kNumberBytes : 0);
    const std::byte* from = records_of(leaf).data();
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
  const EstimateOptions& options_;
  EstimatedPoints& out_;
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
  output.array = context.make_array("estimate", input.tree.points() * output.stride);
  context.progress->begin("estimate", input.tree.points());
  run_in_arena(workers_within(context, worker_bytes(input, options, output.stride)),
               [&] { Estimator(input, options, output, context).run(); });
  context.progress->end();
  return output;
}

}  // namespace cairn::stages
