#include "stages/cluster/grid_reducer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>
#include <unordered_map>
#include <utility>

#include "formats/error.h"
#include "stages/cluster/curve_points.h"
#include "stages/cluster/numbering.h"
#include "stages/cluster/places.h"
#include "stages/portable_log.h"

namespace cairn::stages {
namespace {

/// The grid's widths that are tried, each halving the range in which the right one lies.
constexpr int kHalvings = 24;
constexpr int kCellBits = 21;  ///< of a cell's number along an axis

/// The occupied cells of one width. A cell is known by the place of its first point on the curve.
class Cells {
 public:
  Cells(const NodeView& node, std::span<const Location> places, const Location& low, double width)
      : low_(low), width_(width), cell_of_(places.size()) {
    numbers_.reserve(places.size() / 2);
    for (const std::uint32_t point : node.curve.order) {
      const auto next = static_cast<std::uint32_t>(numbers_.size());
      const auto [cell, added] = numbers_.try_emplace(key(coordinates(places[point])), next);
      cell_of_[point] = cell->second;
    }
  }

  std::size_t count() const { return numbers_.size(); }
  const std::vector<std::uint32_t>& of_points() const { return cell_of_; }

  /// Calls visit(cell, factor) for the occupied cells whose center is less than a width from the place.
  template <typename Visit>
  void visit_near(const Location& place, const Visit& visit) const {
    const Location at = scaled(place);
    for (int corner = 0; corner < 8; ++corner) {
      std::array<std::uint64_t, 3> cell;
      double square = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        // The two centers on either side of the place.
        const double below = std::floor(at[axis] - 0.5) + ((corner >> axis) & 1);
        if (below < 0) square = 1;
        cell[axis] = static_cast<std::uint64_t>(std::max(below, 0.0));
        square += (at[axis] - below - 0.5) * (at[axis] - below - 0.5);
      }
      if (square >= 1) continue;
      const auto found = numbers_.find(key(cell));
      if (found != numbers_.end()) visit(found->second, 1 - std::sqrt(square));
    }
  }

 private:
  Location scaled(const Location& place) const {
    Location at;
    for (std::size_t axis = 0; axis < 3; ++axis) at[axis] = (place[axis] - low_[axis]) / width_;
    return at;
  }

  std::array<std::uint64_t, 3> coordinates(const Location& place) const {
    const Location at = scaled(place);
    return {static_cast<std::uint64_t>(at[0]), static_cast<std::uint64_t>(at[1]),
            static_cast<std::uint64_t>(at[2])};
  }

  static std::uint64_t key(const std::array<std::uint64_t, 3>& cell) {
    return (cell[2] << (2 * kCellBits)) | (cell[1] << kCellBits) | cell[0];
  }

  Location low_;
  double width_;
  std::unordered_map<std::uint64_t, std::uint32_t> numbers_;
  std::vector<std::uint32_t> cell_of_;
};

/// The finest grid found with at most `quota` occupied cells.
Cells fitting_cells(const NodeView& node, std::span<const Location> places, std::uint64_t quota) {
  Location low = places[0], high = low;
  for (const Location& place : places)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], place[axis]);
      high[axis] = std::max(high[axis], place[axis]);
    }
  double extent = *std::ranges::max_element(node.grid.step);
  for (std::size_t axis = 0; axis < 3; ++axis) extent = std::max(extent, high[axis] - low[axis]);
  // Of the widest one cell holds all, of the narrowest a key still holds their numbers. Widths by their logarithm.
  double widest = portable_log(2 * extent);
  double narrowest = widest - (kCellBits - 1) * std::numbers::ln2;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (widest + narrowest) / 2;
    (Cells(node, places, low, portable_exp(middle)).count() <= quota ? widest : narrowest) = middle;
  }
  return Cells(node, places, low, portable_exp(widest));
}

/// Into how many parts each cell is cut so that there are `quota`: again and again the cell with the largest parts.
std::vector<std::uint32_t> parts_of_cells(const std::vector<std::uint32_t>& points,
                                          std::uint64_t quota) {
  using Entry =
      std::pair<double, std::int64_t>;  // points a part; minus the cell: the first of equals first
  std::priority_queue<Entry> fullest;
  for (std::size_t cell = 0; cell < points.size(); ++cell)
    fullest.emplace(points[cell], -static_cast<std::int64_t>(cell));
  std::vector<std::uint32_t> parts(points.size(), 1);
  for (std::uint64_t count = points.size(); count < quota; ++count) {
    const auto cell = static_cast<std::size_t>(-fullest.top().second);
    fullest.pop();
    ++parts[cell];
    fullest.emplace(static_cast<double>(points[cell]) / parts[cell],
                    -static_cast<std::int64_t>(cell));
  }
  return parts;
}

/// Shares for each cell: of all points near its center. A cell that is cut into parts gets none.
std::vector<std::vector<Share>> shares_of_cells(const NodeView& node, const Cells& cells,
                                                std::span<const Location> places,
                                                const std::vector<std::uint32_t>& parts) {
  std::vector<std::vector<Share>> shares(cells.count());
  for (const std::uint32_t point : node.curve.order)
    cells.visit_near(places[point], [&](std::uint32_t cell, double factor) {
      if (parts[cell] == 1) shares[cell].push_back({point, factor});
    });
  return shares;
}

}  // namespace

Reduction GridReducer::reduce(const NodeView& node, std::uint64_t quota) const {
  CAIRN_CHECK(quota >= 1 && quota <= node.position.size());
  const Places exact(node);
  std::vector<Location> places;
  places.reserve(node.position.size());
  for (std::size_t i = 0; i < node.position.size(); ++i) places.push_back(exact[i]);
  const Cells cells = fitting_cells(node, places, quota);
  std::vector<std::uint32_t> points(cells.count());
  for (const std::uint32_t cell : cells.of_points()) ++points[cell];
  const std::vector<std::uint32_t> parts = parts_of_cells(points, quota);

  // The parts of a cell are numbered from its first one on.
  std::vector<std::uint32_t> first_part, cell_of_part, seen(cells.count());
  for (std::uint32_t cell = 0; cell < cells.count(); ++cell) {
    first_part.push_back(static_cast<std::uint32_t>(cell_of_part.size()));
    cell_of_part.insert(cell_of_part.end(), parts[cell], cell);
  }
  Reduction reduction;
  std::vector<std::uint32_t> part_of_point;  // along the curve
  part_of_point.reserve(places.size());
  for (const std::uint32_t point : node.curve.order) {
    const std::uint32_t cell = cells.of_points()[point];
    const std::uint64_t part = std::uint64_t{seen[cell]++} * parts[cell] / points[cell];
    part_of_point.push_back(first_part[cell] + static_cast<std::uint32_t>(part));
  }
  const std::vector<std::uint32_t> part_of = number_along(quota, part_of_point);
  reduction.representative = by_point(node.curve, part_of_point);
  if (filter_ == Filter::kCell) return reduction;
  std::vector<std::vector<Share>> shares = shares_of_cells(node, cells, places, parts);
  reduction.blend.resize(quota);
  for (std::size_t r = 0; r < quota; ++r)
    reduction.blend[r] = std::move(shares[cell_of_part[part_of[r]]]);
  return reduction;
}

}  // namespace cairn::stages
