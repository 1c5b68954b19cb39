// Measures what a view loses by a pixel error or a budget: how far from where they belong points are drawn, against the
// bound that was told, and how the picture differs from that of all points. Exits with 5 if the bound does not hold.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "formats/error.h"
#include "tests/support/pixel_error.h"
#include "viewer/cut_painter.h"

namespace {

using namespace cairn;
using viewer::DrawnCut;
using viewer::PictureDifference;

struct Flags {
  std::string dataset;
  std::string camera = "auto";
  viewer::PictureSize size;
  std::vector<double> taus;
  std::vector<std::uint64_t> budgets;
  std::filesystem::path pictures;
  bool markdown = false;
};

/// One row of the table: a cut, drawn as points and as the dataset calls for.
struct Row {
  std::string name;
  bool culling = false;
  viewer::SelectionLimits limits;
  test::Cut cut;
  DrawnCut points, splats;
};

Row make_row(const viewer::LodTree& tree, const viewer::View& view, std::string name, bool culling,
             viewer::SelectionLimits limits) {
  limits.cull_back_faces = culling;
  Row row{.name = std::move(name), .culling = culling, .limits = limits};
  row.cut.selection = select(tree, view, limits);
  if (limits.pixel_error > 0) row.cut.pixel_error = limits.pixel_error;
  return row;
}

/// The view at full resolution, then at what is asked for; again with culling if the dataset calls for it.
std::vector<Row> make_rows(const Flags& flags, const viewer::LodTree& tree,
                           const viewer::View& view, bool may_cull) {
  std::vector<Row> rows;
  for (const bool culling : {false, true}) {
    if (culling && !may_cull) break;
    rows.push_back(make_row(tree, view, "full", culling, {}));
    for (const double tau : flags.taus)
      rows.push_back(
          make_row(tree, view, fmt::format("tau {:g}", tau), culling, {.pixel_error = tau}));
    for (const std::uint64_t budget : flags.budgets)
      rows.push_back(
          make_row(tree, view, fmt::format("budget {}", budget), culling, {.points = budget}));
  }
  return rows;
}

/// Nodes of the largest cut.
std::uint64_t most_nodes(const std::vector<Row>& rows) {
  std::uint64_t nodes = 1;
  for (const Row& row : rows)
    nodes = std::max<std::uint64_t>(nodes, row.cut.selection.nodes.size());
  return nodes;
}

DrawnCut draw(viewer::CutPainter& painter, const viewer::View& view, const Row& row,
              std::optional<viewer::Primitive> primitive) {
  DrawnCut drawn =
      painter.draw(view, row.limits, {.primitive = primitive, .cull_back_faces = row.culling});
  CAIRN_CHECK(drawn.frame.points == row.cut.selection.points);
  return drawn;
}

std::string file_name(const Row& row, const char* primitive) {
  std::string name = row.name + (row.culling ? " culled " : " ") + primitive + ".png";
  std::ranges::replace(name, ' ', '_');
  return name;
}

using Cells = std::vector<std::string>;

const Cells kHeading{"cut",        "culling",        "points",         "of full",
                     "bound px",   "inner bound px", "max px",         "RMS px",
                     "mean px",    "of own bound",   "points: differ", "points: PSNR",
                     "points: ms", "auto: differ",   "auto: PSNR",     "auto: ms"};

Cells cells_of(const Row& row, const Row& full, const test::Displacement& measured) {
  const PictureDifference points = difference_of(full.points.shown, row.points.shown);
  const PictureDifference splats = difference_of(full.splats.shown, row.splats.shown);
  const auto count = [](const Row& of) { return static_cast<double>(of.cut.selection.points); };
  return {row.name,
          row.culling ? "yes" : "no",
          std::to_string(row.cut.selection.points),
          fmt::format("{:.1f} %", 100 * count(row) / std::max(count(full), 1.0)),
          fmt::format("{:.3f}", row.cut.selection.pixel_bound),
          fmt::format("{:.3f}", row.cut.selection.inner_bound),
          fmt::format("{:.3f}", measured.max),
          fmt::format("{:.3f}", measured.rms()),
          fmt::format("{:.3f}", measured.mean()),
          fmt::format("{:.2f}", measured.worst_share),
          fmt::format("{:.1f} %", 100 * points.differ),
          fmt::format("{:.1f}", points.psnr()),
          fmt::format("{:.1f}", row.points.frame.draw_ms),
          fmt::format("{:.1f} %", 100 * splats.differ),
          fmt::format("{:.1f}", splats.psnr()),
          fmt::format("{:.1f}", row.splats.frame.draw_ms)};
}

void print_table(const std::vector<Cells>& table, bool markdown) {
  std::vector<std::size_t> widths(table.front().size());
  for (const Cells& cells : table)
    for (std::size_t i = 0; i < cells.size(); ++i) widths[i] = std::max(widths[i], cells[i].size());
  for (const Cells& cells : table) {
    std::string line = markdown ? "|" : "";
    for (std::size_t i = 0; i < cells.size(); ++i)
      line += markdown ? " " + cells[i] + " |" : fmt::format("{:>{}}  ", cells[i], widths[i]);
    fmt::print("{}\n", line);
    if (!markdown || &cells != &table.front()) continue;
    line = "| --- | --- |";
    for (std::size_t i = 2; i < cells.size(); ++i) line += " ---: |";
    fmt::print("{}\n", line);
  }
}

/// What of a row is not as it must be; empty if all is.
std::string fault_of(const Row& row, const test::Displacement& measured) {
  if (measured.above > 0)
    return fmt::format("{} points are farther off than was told", measured.above);
  if (measured.covered_twice > 0)
    return fmt::format("{} points are drawn twice", measured.covered_twice);
  if (!row.culling && measured.uncovered > 0)
    return fmt::format("{} points are not drawn", measured.uncovered);
  return {};
}

int run(const Flags& flags) {
  const auto dataset = formats::DatasetReader::open(flags.dataset);
  const viewer::LodTree tree(dataset.tree(), dataset.header().grid, dataset.nodes());
  const viewer::Box& scene = tree.node(0).box;
  const viewer::Camera camera = flags.camera == "auto" ? camera_around(scene, flags.size)
                                                       : viewer::parse_camera(flags.camera);
  const viewer::View view(camera, flags.size, viewer::near_plane(scene));
  const auto plan =
      viewer::plan_frame(viewer::facts_of(dataset.header()), {}, {}, /*queries=*/false);
  std::vector<Row> rows = make_rows(flags, tree, view, plan.cull_back_faces);
  viewer::CutPainter painter(dataset, tree, plan, most_nodes(rows), 1);
  std::vector<test::Cut> cuts;
  for (Row& row : rows) {
    row.points = draw(painter, view, row, viewer::Primitive::kPoints);
    row.splats = draw(painter, view, row, std::nullopt);
    cuts.push_back(row.cut);
    if (flags.pictures.empty()) continue;
    write_png(row.points.shown.picture, flags.pictures / file_name(row, "points"));
    write_png(row.splats.shown.picture, flags.pictures / file_name(row, "auto"));
  }
  const auto measured = test::measure_displacement(dataset, tree, view, cuts);

  std::vector<Cells> table{kHeading};
  const Row* full = nullptr;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].name == "full") full = &rows[i];
    table.push_back(cells_of(rows[i], *full, measured[i]));
  }
  print_table(table, flags.markdown);
  bool holds = true;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string fault = fault_of(rows[i], measured[i]);
    if (fault.empty()) continue;
    fmt::print(stderr, "pixel_error: {}: {}\n", rows[i].name, fault);
    holds = false;
  }
  return holds ? 0 : static_cast<int>(formats::ErrorKind::kInvariant);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures how far from where they belong a cut draws the points of a dataset",
               "pixel_error");
  Flags flags;
  app.add_option("dataset", flags.dataset, "the dataset")->required();
  app.add_option("--camera", flags.camera, "auto, or EX,EY,EZ/TX,TY,TZ[/UX,UY,UZ[/FOV]]");
  app.add_option("--width", flags.size.width, "of the picture")->check(CLI::Range(1, 16384));
  app.add_option("--height", flags.size.height, "of the picture")->check(CLI::Range(1, 16384));
  app.add_option("--tau", flags.taus, "pixel errors to measure")->check(CLI::PositiveNumber);
  app.add_option("--budget", flags.budgets, "budgets to measure, points");
  app.add_option("--pictures", flags.pictures, "folder to write pictures into");
  app.add_flag("--markdown", flags.markdown, "print the table as Markdown");
  CLI11_PARSE(app, argc, argv);
  if (flags.taus.empty() && flags.budgets.empty()) flags.taus = {1, 2, 4};
  try {
    return run(flags);
  } catch (const formats::Error& error) {
    fmt::print(stderr, "pixel_error: error: {}\n", error.what());
    return static_cast<int>(error.kind());
  }
}
