// Small campaigns for the tests of effects: scans of steps in memory, their points numbered and colored.
#pragma once

#include <cstring>
#include <random>
#include <vector>

#include "stages/filter/filter.h"
#include "stages/import/import.h"
#include "stages/split/split.h"
#include "tests/support/stage_fixture.h"

namespace cairn::test {

struct ColoredPoint {
  formats::GridPoint position;
  std::uint32_t number = 0;
  std::array<std::uint16_t, 3> color{};
  std::uint32_t scan = 0;
  friend auto operator<=>(const ColoredPoint&, const ColoredPoint&) = default;
};

/// All points of all scans, in campaign order.
using ColoredCampaign = std::vector<ColoredPoint>;

/// `count` points of each of `scans` scans, with coordinates of 0 to range - 1, numbers in campaign order.
inline ColoredCampaign random_campaign(std::uint32_t scans, std::uint32_t count,
                                       std::uint32_t range, unsigned seed) {
  std::mt19937 random(seed);
  const auto coordinate = [&] { return static_cast<std::int32_t>(random() % range); };
  const auto value = [&] { return static_cast<std::uint16_t>(random() % 65536); };
  ColoredCampaign points;
  for (std::uint32_t i = 0; i < scans * count; ++i)
    points.push_back(
        {{coordinate(), coordinate(), coordinate()}, i, {value(), value(), value()}, i / count});
  return points;
}

/// A campaign's points after the effects.
struct FilteredCampaign {
  stages::FilteredPoints filtered;
  std::vector<std::byte> bytes;  ///< of the records
  ColoredCampaign points;        ///< sorted; positions as they were given

  std::vector<std::uint32_t> numbers() const {
    std::vector<std::uint32_t> numbers;
    for (const ColoredPoint& p : points) numbers.push_back(p.number);
    std::sort(numbers.begin(), numbers.end());
    return numbers;
  }
};

class FilterFixture : public StageFixture {
 protected:
  static constexpr std::size_t kContentBytes = 22;

  static stages::Scans scans_of(const ColoredCampaign& points) {
    using formats::ReduceRule;
    using formats::ScalarType;
    std::vector<formats::PointBlock> blocks;
    for (const ColoredPoint& p : points) {
      if (blocks.size() <= p.scan) blocks.resize(p.scan + 1);
      formats::PointBlock& block = blocks[p.scan];
      ++block.count;
      block.steps.push_back(p.position);
      block.columns.resize(2);
      const auto number = std::as_bytes(std::span(&p.number, 1));
      const auto color = std::as_bytes(std::span(p.color));
      block.columns[0].insert(block.columns[0].end(), number.begin(), number.end());
      block.columns[1].insert(block.columns[1].end(), color.begin(), color.end());
    }
    stages::Scans scans;
    for (const formats::PointBlock& block : blocks)
      scans.push_back(steps_scan({{"number", ScalarType::kU32, 1, ReduceRule::kNone},
                                  {"color", ScalarType::kU16, 3, ReduceRule::kMean}},
                                 {block}));
    return scans;
  }

  FilteredCampaign run(const ColoredCampaign& campaign, const stages::FilterOptions& options,
                       std::uint64_t node_points, bool keep_numbers = true) {
    stages::ImportedPoints imported =
        stages::import_scans(scans_of(campaign), {.number_scans = true}, context());
    const formats::Grid grid = imported.grid;
    const formats::Schema schema = imported.schema;
    const std::size_t scans = imported.ledger.size();
    const formats::Tree tree(imported.points, 3, node_points);
    stages::SplitPoints split = stages::split(std::move(imported), tree, context());
    FilteredCampaign result;
    result.filtered =
        stages::filter({split.array, split.stride, true, keep_numbers, grid, tree, schema, scans},
                       options, context());
    const auto& array = std::as_const(result.filtered.array);
    result.bytes.assign(array.bytes().begin(), array.bytes().end());
    for (std::size_t at = 0; at < result.bytes.size(); at += result.filtered.stride) {
      const std::byte* record = result.bytes.data() + at;
      ColoredPoint point;
      std::memcpy(point.position.data(), record, 12);
      for (std::size_t axis = 0; axis < 3; ++axis)
        point.position[axis] += static_cast<std::int32_t>(grid.shift[axis]);
      std::memcpy(&point.number, record + 12, 4);
      std::memcpy(point.color.data(), record + 16, 6);
      if (keep_numbers) std::memcpy(&point.scan, record + kContentBytes, 4);
      result.points.push_back(point);
    }
    std::sort(result.points.begin(), result.points.end());
    return result;
  }
};

}  // namespace cairn::test
