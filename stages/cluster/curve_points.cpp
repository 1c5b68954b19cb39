#include "stages/cluster/curve_points.h"

namespace cairn::stages {

CurvePoints points_along_curve(const NodeView& node) {
  const auto& order = node.curve.order;
  const formats::GridPoint origin = node.position[order[0]];
  CurvePoints points;
  const auto fill = [&](auto& column, const auto& value_of) {
    column.resize(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) column[i] = value_of(order[i]);
  };
  const auto fill_axis = [&](std::vector<double>& column, std::size_t axis) {
    const double scale = node.grid.step[axis] * node.curve.cells_per_unit;
    fill(column, [&](std::uint32_t point) {
      return static_cast<double>(std::int64_t{node.position[point][axis]} - origin[axis]) * scale;
    });
  };
  fill_axis(points.x, 0);
  fill_axis(points.y, 1);
  fill_axis(points.z, 2);
  if (!node.weight.empty())
    fill(points.weight,
         [&](std::uint32_t point) { return static_cast<double>(node.weight[point]); });
  if (node.normal.empty()) return points;
  fill(points.nx, [&](std::uint32_t point) { return node.normal[point][0]; });
  fill(points.ny, [&](std::uint32_t point) { return node.normal[point][1]; });
  fill(points.nz, [&](std::uint32_t point) { return node.normal[point][2]; });
  return points;
}

std::vector<std::uint32_t> by_point(const CurveOrder& curve,
                                    const std::vector<std::uint32_t>& along_curve) {
  std::vector<std::uint32_t> values(along_curve.size());
  for (std::size_t i = 0; i < along_curve.size(); ++i) values[curve.order[i]] = along_curve[i];
  return values;
}

}  // namespace cairn::stages
