#include "stages/measure/sample.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>

#include "formats/checksum.h"
#include "formats/dataset/effect_metadata.h"
#include "formats/dataset/hilbert.h"
#include "formats/error.h"
#include "formats/wide_int.h"
#include "stages/mix.h"

namespace cairn::stages {
namespace {

using formats::GridBox;
using formats::GridPoint;

/// Points of scans are searched for in batches of so many.
constexpr std::size_t kBatch = 4096;

/// Reducers choose by the same hash of a node and a number: the sample must have nothing to do with that.
constexpr std::uint64_t kSampleSeed = 0x6d656173757265ULL;

/// Sorts points along a curve through the box, those of one cell by position: no order of threads is left.
void sort_along_curve(std::vector<GridPoint>& points, const GridBox& box) {
  std::uint32_t span = 0;
  for (int axis = 0; axis < 3; ++axis) span = std::max(span, box.span(axis));
  int shift = 0;
  while (span >> shift >> formats::kHilbertBits != 0) ++shift;
  std::vector<std::pair<std::uint64_t, GridPoint>> keyed;
  keyed.reserve(points.size());
  for (const GridPoint& p : points) {
    const auto cell = [&](std::size_t axis) {
      return static_cast<std::uint16_t>((std::int64_t{p[axis]} - box.min[axis]) >> shift);
    };
    keyed.emplace_back(formats::hilbert_key(cell(0), cell(1), cell(2)), p);
  }
  std::ranges::sort(keyed);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = keyed[i].second;
}

}  // namespace

Chooser::Chooser(std::uint64_t wanted, std::uint64_t total) : all_(wanted >= total) {
  if (!all_) threshold_ = static_cast<std::uint64_t>((formats::Uint128{wanted} << 64) / total);
}

std::vector<GridPoint> Chooser::taken_of(formats::NodeId id, std::vector<GridPoint> points) const {
  if (all_) return points;
  const std::uint64_t of_node = mix(kSampleSeed, formats::value_of(id));
  std::size_t taken = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (takes(mix(of_node, i))) points[taken++] = points[i];
  points.resize(taken);
  return points;
}

PointSample sample_of_level(const formats::DatasetReader& dataset, formats::Level level,
                            std::uint64_t wanted) {
  const formats::Tree& tree = dataset.tree();
  const std::uint64_t nodes = tree.nodes_on(level);
  std::uint64_t points = 0;
  for (std::uint64_t i = 0; i < nodes; ++i) points += dataset.record(tree.id(level, i)).point_count;
  const Chooser chooser(wanted, points);
  return {.is_all = chooser.takes_all(),
          .points = std::min(wanted, points),
          .batches = wanted == 0 ? 0 : nodes,
          .batch = [&dataset, chooser,
                    first = formats::value_of(tree.id(level, 0))](std::uint64_t batch) {
            formats::SectionSet wanted_sections;
            wanted_sections.set(formats::kPositionSection);
            const formats::NodeId id{first + batch};
            return chooser.taken_of(id, dataset.read_node(id, wanted_sections).position);
          }};
}

PointSample sample_of_scans(const Context& context, const formats::DatasetReader& dataset,
                            const RecordSource& scans, std::uint64_t wanted) {
  const std::uint64_t points = formats::points_before_effects(dataset.header(), dataset.metadata());
  const Chooser chooser(wanted, points);
  // Sorting takes twice the points and their keys for a while.
  const std::uint64_t most = context.memory_bytes / 4 / (2 * sizeof(GridPoint) + 32);
  std::mutex mutex;
  const auto taken = std::make_shared<std::vector<GridPoint>>();
  GridBox box;
  if (context.progress != nullptr) context.progress->begin("sample", points);
  scans([&](std::span<const std::byte> records, std::size_t stride) {
    std::vector<GridPoint> some;
    for (std::size_t at = 0; at < records.size(); at += stride) {
      const auto record = records.subspan(at, stride);
      if (!chooser.takes(mix(kSampleSeed, formats::checksum_of(record)))) continue;
      std::memcpy(some.emplace_back().data(), record.data(), sizeof(GridPoint));
    }
    const std::lock_guard lock(mutex);
    if (taken->size() + some.size() > most)
      formats::throw_usage("a sample of more than " + std::to_string(most) +
                           " points of the scans does not fit in memory: ask for fewer");
    if (context.progress != nullptr) context.progress->advance(records.size() / stride);
    taken->insert(taken->end(), some.begin(), some.end());
    for (const GridPoint& p : some) box.add(p);
  });
  sort_along_curve(*taken, box);
  if (context.progress != nullptr) context.progress->end();
  return {.is_all = chooser.takes_all(),
          .points = taken->size(),
          .batches = (taken->size() + kBatch - 1) / kBatch,
          .batch = [taken](std::uint64_t batch) {
            const auto first = taken->begin() + static_cast<std::ptrdiff_t>(batch * kBatch);
            const auto left = static_cast<std::size_t>(taken->end() - first);
            return std::vector<GridPoint>(
                first, first + static_cast<std::ptrdiff_t>(std::min(kBatch, left)));
          }};
}

}  // namespace cairn::stages
