// Balance of exposure: scans that look at the same surface are given the gains that make them tell the same brightness
// of it, a color channel for itself. See gain_solver.h for the fit.
#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <tuple>

#include "formats/error.h"
#include "stages/filter/cell_reduction.h"
#include "stages/filter/effect.h"
#include "stages/filter/gain_solver.h"
#include "stages/filter/lattice.h"
#include "stages/portable_log.h"

namespace cairn::stages {

namespace {

constexpr std::size_t kMostChannels = 3;
/// Points a cell of the lattice should hold.
constexpr double kCellPoints = 16;

/// One clipped value of so many points may be: the mean differs by less than that, and large cells are not silenced.
constexpr std::uint64_t kClippedShare = 64;

/// What a scan tells of a cell.
struct Sample {
  Cell cell;
  std::uint32_t scan;
  std::uint64_t points;
  std::array<std::uint64_t, kMostChannels> sum;
  std::array<std::uint64_t, kMostChannels>
      clipped;  ///< points whose value is the least or the largest possible
  auto key() const { return std::tie(cell, scan); }
};

/// Fitting takes place where values tell brightness: not where many are clipped, since these do not follow the gain.
bool tells(const Sample& sample, std::size_t channel) {
  return sample.clipped[channel] <= sample.points / kClippedShare;
}

using ChannelOverlaps = std::array<Overlaps, kMostChannels>;

void add_pair(const Sample& a, const Sample& b, std::size_t channels, ChannelOverlaps& overlaps) {
  const auto n = static_cast<double>(a.points), m = static_cast<double>(b.points);
  for (std::size_t c = 0; c < channels; ++c) {
    if (!tells(a, c) || !tells(b, c)) continue;
    const double ratio = portable_log(static_cast<double>(a.sum[c]) / n) -
                         portable_log(static_cast<double>(b.sum[c]) / m);
    overlaps[c][{a.scan, b.scan}].add(ratio, n * m / (n + m));
  }
}

/// Samples of cells that are complete, by cell and scan.
void add_cells(std::span<const Sample> samples, std::size_t channels, ChannelOverlaps& overlaps) {
  for (std::size_t first = 0, end = 0; first < samples.size(); first = end) {
    while (end < samples.size() && samples[end].cell == samples[first].cell) ++end;
    for (std::size_t i = first; i < end; ++i)
      for (std::size_t j = i + 1; j < end; ++j)
        add_pair(samples[i], samples[j], channels, overlaps);
  }
}

/// A leaf's points lie on a surface, more or less, so that cells of this side hold kCellPoints: the median over leaves.
double choose_side(const Cloud& cloud) {
  std::vector<double> sides;
  const double cells = std::sqrt(
      std::max(1.0, static_cast<double>(cloud.leaves.tree().node_points()) / kCellPoints));
  for (const formats::GridBox& box : cloud.boxes) {
    double longest = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      longest = std::max(longest, cloud.grid.step[axis] * box.span(static_cast<int>(axis)));
    sides.push_back(longest / cells);
  }
  const auto median = sides.begin() + static_cast<std::ptrdiff_t>(sides.size() / 2);
  std::nth_element(sides.begin(), median, sides.end());
  return *median;
}

std::uint32_t gain_of(double log_gain) {
  const double units =
      std::floor(portable_exp(std::clamp(log_gain, -20.0, 20.0)) * formats::kUnitGain + 0.5);
  return static_cast<std::uint32_t>(std::clamp(units, 1.0, double{UINT32_MAX}));
}

class ExposureBalance final : public Effect {
 public:
  std::string_view name() const override { return kExposureEffect; }

  void act(Cloud& cloud, std::uint8_t, Context& context) const override {
    CAIRN_CHECK(cloud.balanced.has_value());
    const std::size_t channels = cloud.balanced->components;
    const ChannelOverlaps overlaps = measure(cloud, channels, context);
    cloud.gains.assign(cloud.scans, formats::Gains(channels));
    for (std::size_t c = 0; c < channels; ++c) {
      const std::vector<double> logs = solve_log_gains(overlaps[c], cloud.scans);
      for (std::size_t s = 0; s < cloud.scans; ++s) cloud.gains[s][c] = gain_of(logs[s]);
    }
  }

 private:
  static ChannelOverlaps measure(Cloud& cloud, std::size_t channels, const Context& context) {
    const Lattice lattice(cloud.grid, choose_side(cloud));
    const NodeBoxes nodes(cloud.leaves.tree(), cloud.boxes);
    ChannelOverlaps overlaps;
    std::mutex mutex;
    const CellRules<Sample> rules{
        .cell_of = [&](std::size_t axis, std::int32_t c) { return lattice.cell_of(axis, c); },
        .read = [&](std::uint64_t leaf) { return read(cloud, leaf, lattice, context); },
        .absorb =
            [](Sample& into, const Sample& other) {
              into.points += other.points;
              for (std::size_t c = 0; c < kMostChannels; ++c) {
                into.sum[c] += other.sum[c];
                into.clipped[c] += other.clipped[c];
              }
            },
        .merged = {},
        .complete =
            [&](std::span<const Sample> samples) {
              ChannelOverlaps part;
              add_cells(samples, channels, part);
              const std::lock_guard lock(mutex);
              for (std::size_t c = 0; c < channels; ++c)
                for (const auto& [pair, overlap] : part[c]) overlaps[c][pair].add(overlap);
            }};
    const std::uint64_t leaf_points = cloud.leaves.tree().node_points();
    run_in_arena(
        workers_within(context, leaf_points * (2 * sizeof(Sample) + cloud.leaves.stride() + 1)),
        [&] { CellReduction(nodes, rules).run(); });
    return overlaps;
  }

  static std::vector<Sample> read(Cloud& cloud, std::uint64_t leaf, const Lattice& lattice,
                                  const Context& context) {
    throw_if_stopped(context);
    const formats::BalancedColumn& column = *cloud.balanced;
    std::vector<Sample> samples;
    samples.reserve(cloud.leaves.range_of(leaf).count);
    cloud.for_each_kept(leaf, [&](std::uint64_t, const std::byte* record) {
      Sample sample{lattice.cell_at(position_of(record)), cloud.scan_of(record), 1, {}, {}};
      for (std::size_t c = 0; c < column.components; ++c) {
        const std::uint32_t value = column.value(record, c);
        if (value == 0 || value == column.largest_value()) sample.clipped[c] = 1;
        sample.sum[c] = value;
      }
      samples.push_back(sample);
    });
    cloud.release(leaf);
    context.progress->advance(cloud.leaves.range_of(leaf).count);
    return samples;
  }
};

}  // namespace

std::unique_ptr<Effect> make_exposure_balance() { return std::make_unique<ExposureBalance>(); }

}  // namespace cairn::stages
