// Thinning: of the points in each cell of a cubic lattice one is kept, the nearest to the cell's center; of equally
// near ones that of the least position, of these the first of the campaign. A lattice and not Poisson discs, which
// would depend on the order in which points are taken; two kept points may be nearer than a cell's side, across the
// border of two cells.
#include <tuple>

#include "stages/filter/cell_reduction.h"
#include "stages/filter/effect.h"
#include "stages/filter/lattice.h"

namespace cairn::stages {

namespace {

struct Candidate {
  Cell cell;
  double squared_distance;  ///< to the cell's center
  formats::GridPoint position;
  std::uint64_t point;

  const Cell& key() const { return cell; }
  bool is_better_than(const Candidate& other) const {
    return std::tie(squared_distance, position, point) <
           std::tie(other.squared_distance, other.position, other.point);
  }
};

class Thinning final : public Effect {
 public:
  explicit Thinning(double side) : side_(side) {}
  std::string_view name() const override { return "thinning"; }

  void act(Cloud& cloud, std::uint8_t mark, Context& context) const override {
    const Lattice lattice(cloud.grid, side_);
    const NodeBoxes nodes(cloud.leaves.tree(), cloud.boxes);
    const CellRules<Candidate> rules{
        .cell_of = [&](std::size_t axis, std::int32_t c) { return lattice.cell_of(axis, c); },
        .read = [&](std::uint64_t leaf) { return read(cloud, leaf, lattice, context); },
        .absorb =
            [&](Candidate& into, const Candidate& other) {
              const bool other_wins = other.is_better_than(into);
              cloud.mark(other_wins ? into.point : other.point, mark);
              if (other_wins) into = other;
            },
        .merged =
            [&](formats::IndexRange points) { cloud.marks.release(points.first, points.count); },
        .complete = [](std::span<const Candidate>) {}};
    const std::uint64_t leaf_points = cloud.leaves.tree().node_points();
    run_in_arena(
        workers_within(context, leaf_points * (2 * sizeof(Candidate) + cloud.leaves.stride() + 1)),
        [&] { CellReduction(nodes, rules).run(); });
  }

 private:
  static std::vector<Candidate> read(Cloud& cloud, std::uint64_t leaf, const Lattice& lattice,
                                     const Context& context) {
    throw_if_stopped(context);
    std::vector<Candidate> candidates;
    candidates.reserve(cloud.leaves.range_of(leaf).count);
    cloud.for_each_kept(leaf, [&](std::uint64_t point, const std::byte* record) {
      const formats::GridPoint position = position_of(record);
      const Cell cell = lattice.cell_at(position);
      candidates.push_back(
          {cell, lattice.squared_distance_to_center(position, cell), position, point});
    });
    cloud.release(leaf);
    context.progress->advance(cloud.leaves.range_of(leaf).count);
    return candidates;
  }

  double side_;
};

}  // namespace

std::unique_ptr<Effect> make_thinning(double side) { return std::make_unique<Thinning>(side); }

}  // namespace cairn::stages
