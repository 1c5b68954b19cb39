// Removal of points that are given twice, as overlapping deliveries of a survey do. The one that comes first in the
// campaign is kept.
#include <tuple>

#include "formats/dataset/digest.h"
#include "stages/filter/cell_reduction.h"
#include "stages/filter/effect.h"

namespace cairn::stages {

namespace {

/// Cells are positions. Of one position, records stand in campaign order.
struct Copy {
  Cell cell;
  formats::Digest content;  ///< of the record, if attributes matter
  std::uint64_t point;
  auto key() const { return std::tie(cell, content.low, content.high); }
};

class DuplicateRemoval final : public Effect {
 public:
  explicit DuplicateRemoval(Duplicates duplicates) : duplicates_(duplicates) {}
  std::string_view name() const override { return "duplicates"; }

  void act(Cloud& cloud, std::uint8_t mark, Context& context) const override {
    const NodeBoxes nodes(cloud.leaves.tree(), cloud.boxes);
    const CellRules<Copy> rules{
        .cell_of = [](std::size_t, std::int32_t coordinate) { return std::int64_t{coordinate}; },
        .read = [&](std::uint64_t leaf) { return read(cloud, leaf, context); },
        .absorb =
            [&](Copy& into, const Copy& other) {
              cloud.mark(std::max(into.point, other.point), mark);
              into.point = std::min(into.point, other.point);
            },
        .merged =
            [&](formats::IndexRange points) { cloud.marks.release(points.first, points.count); },
        .complete = [](std::span<const Copy>) {}};
    const std::uint64_t leaf_points = cloud.leaves.tree().node_points();
    run_in_arena(
        workers_within(context, leaf_points * (2 * sizeof(Copy) + cloud.leaves.stride() + 1)),
        [&] { CellReduction(nodes, rules).run(); });
  }

 private:
  std::vector<Copy> read(Cloud& cloud, std::uint64_t leaf, const Context& context) const {
    throw_if_stopped(context);
    std::vector<Copy> copies;
    copies.reserve(cloud.leaves.range_of(leaf).count);
    cloud.for_each_kept(leaf, [&](std::uint64_t point, const std::byte* record) {
      const formats::GridPoint p = position_of(record);
      copies.push_back({{p[0], p[1], p[2]}, {}, point});
      if (duplicates_ == Duplicates::kExact)
        copies.back().content =
            formats::digest_of({record, cloud.content_bytes()}, cloud.content_bytes());
    });
    cloud.release(leaf);
    context.progress->advance(cloud.leaves.range_of(leaf).count);
    return copies;
  }

  Duplicates duplicates_;
};

}  // namespace

std::unique_ptr<Effect> make_duplicate_removal(Duplicates duplicates) {
  return std::make_unique<DuplicateRemoval>(duplicates);
}

}  // namespace cairn::stages
