#include "pipeline/export_choice.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <string_view>

#include "formats/error.h"
#include "pipeline/number_list.h"
#include "pipeline/point_count.h"
#include "viewer/error_cut.h"

namespace cairn::pipeline {
namespace {

using formats::Level;
using stages::WorldBox;

[[noreturn]] void refuse(const char* flag, const std::string& found, std::string expected) {
  throw formats::Error(formats::ErrorKind::kUsage,
                       {.what = flag, .found = "'" + found + "'", .expected = std::move(expected)});
}

void require_consistent(const ExportFlags& flags) {
  if (!flags.level.empty() && !flags.budget.empty())
    formats::throw_usage("--budget chooses levels itself: --level is not given beside it");
  if (!flags.around.empty() && flags.budget.empty())
    formats::throw_usage("--around tells where a --budget is spent: none is given");
  if (flags.radius && flags.around.empty())
    formats::throw_usage("--radius is one around a point: --around is not given");
  if (flags.radius && !(*flags.radius >= 0 && std::isfinite(*flags.radius)))
    refuse("--radius", fmt::format("{}", *flags.radius), "a length from 0, in world units");
}

Level level_of(const std::string& text, const formats::Tree& tree) {
  if (text.empty() || text == "leaves") return tree.leaf_level();
  Level level = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), level);
  if (error == std::errc{} && end == text.data() + text.size() && level <= tree.leaf_level())
    return level;
  refuse("--level", text, fmt::format("leaves or 0 to {}", tree.leaf_level()));
}

std::optional<WorldBox> box_of(const formats::DatasetReader& dataset, const std::string& text) {
  if (text.empty()) return std::nullopt;
  const std::vector<double> n = parse_numbers(text);
  if (n.size() != 6) refuse("--box", text, "six numbers MINX,MINY,MINZ,MAXX,MAXY,MAXZ");
  const WorldBox box{{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
  const formats::Grid& grid = dataset.header().grid;
  const formats::GridBox& all = dataset.record(formats::NodeId{0}).box;
  const auto low = grid.world(all.min), high = grid.world(all.max);
  bool meets = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (box.min[axis] > box.max[axis])
      refuse("--box", text, "no minimum above its maximum: MINX,MINY,MINZ,MAXX,MAXY,MAXZ");
    meets = meets && box.min[axis] <= high[axis] && box.max[axis] >= low[axis];
  }
  if (!meets)
    refuse(
        "--box", text,
        fmt::format(
            "a box that meets that of the points, {:.12g},{:.12g},{:.12g},{:.12g},{:.12g},{:.12g}",
            low[0], low[1], low[2], high[0], high[1], high[2]));
  return box;
}

viewer::Box lod_box(const WorldBox& box) {
  viewer::Box result;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    // Halves first: the ends may be as far apart as doubles go. Rounded outwards, to lose nothing at the edge.
    result.center[axis] = box.min[a] / 2 + box.max[a] / 2;
    const double half =
        std::max(box.max[a] - result.center[axis], result.center[axis] - box.min[a]);
    result.half[axis] = std::nextafter(half, INFINITY);
  }
  return result;
}

viewer::ErrorCutLimits limits_of(const ExportFlags& flags, const std::optional<WorldBox>& box) {
  viewer::ErrorCutLimits limits;
  const auto points = parse_count(flags.budget);
  if (!points) refuse("--budget", flags.budget, "a number of points such as 500k or 3M, or all");
  limits.points = *points;
  if (!flags.around.empty()) {
    const std::vector<double> place = parse_numbers(flags.around);
    if (place.size() != 3) refuse("--around", flags.around, "three numbers X,Y,Z");
    limits.focus =
        viewer::Focus{.point = {place[0], place[1], place[2]}, .radius = flags.radius.value_or(0)};
  }
  if (box) limits.within = lod_box(*box);
  return limits;
}

ExportChoice choose_cut(const formats::DatasetReader& dataset, const ExportFlags& flags,
                        std::optional<WorldBox> box) {
  const viewer::LodTree tree(dataset.tree(), dataset.header().grid, dataset.nodes());
  const viewer::ErrorCut cut = select_by_error(tree, limits_of(flags, box));
  ExportChoice choice{.selection = {.nodes = {}, .box = box}, .title = "", .bound = cut.bound};
  auto& nodes = choice.selection.nodes;
  for (const viewer::FrontBlock& block : cut.front) {
    const formats::NodeId node{block.node};
    if (nodes.empty() || nodes.back().node != node) nodes.push_back({node, 0});
    nodes.back().blocks |= std::uint64_t{1} << block.block;
  }
  if (nodes.empty()) formats::throw_usage("no point lies inside the box: nothing is written");
  const Level first = dataset.tree().level_of(nodes.front().node);
  const Level last = dataset.tree().level_of(nodes.back().node);
  choice.title =
      first == last ? fmt::format("level {}", first) : fmt::format("levels {} to {}", first, last);
  return choice;
}

}  // namespace

ExportChoice choose_export(const formats::DatasetReader& dataset, const ExportFlags& flags) {
  require_consistent(flags);
  const std::optional<WorldBox> box = box_of(dataset, flags.box);
  if (!flags.budget.empty()) return choose_cut(dataset, flags, box);
  const Level level = level_of(flags.level, dataset.tree());
  return {.selection = stages::level_selection(dataset, level, box),
          .title = fmt::format("level {}", level),
          .bound = std::nullopt};
}

}  // namespace cairn::pipeline
