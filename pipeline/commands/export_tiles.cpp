#include "pipeline/commands/export_tiles.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <thread>

#include "formats/error.h"
#include "pipeline/commands/results.h"
#include "pipeline/commands/setting_flags.h"
#include "pipeline/human.h"
#include "pipeline/number_list.h"
#include "pipeline/progress.h"

namespace cairn::pipeline {
namespace {

/// "LON,LAT" or "LON,LAT,HEIGHT".
formats::GeographicPlace place_of(const std::string& text) {
  const std::vector<double> numbers = parse_numbers(text);
  const bool complete = numbers.size() == 2 || numbers.size() == 3;
  if (!complete || std::abs(numbers[0]) > 360 || std::abs(numbers[1]) > 90)
    throw formats::Error(
        formats::ErrorKind::kUsage,
        {.what = "--place",
         .found = "'" + printable(text) + "'",
         .expected = "longitude,latitude[,height] in degrees and metres, as -123.07,44.06,120"});
  return {numbers[0], numbers[1], numbers.size() == 3 ? numbers[2] : 0};
}

std::string units_of(const TilesResult& result) {
  if (!result.unit_is_told)
    return "coordinates were taken as metres: nothing tells the unit of x and y "
           "(--metres-per-unit)";
  std::string text = fmt::format("a unit of the dataset is {} m", significant(result.unit_m[0], 8));
  if (result.unit_m[2] != result.unit_m[0])
    text += fmt::format(", one of height {} m", significant(result.unit_m[2], 8));
  return text;
}

std::string text_of(const TilesResult& result, const TilesJob& job) {
  const stages::TilesReport& tiles = result.tiles;
  std::string text = fmt::format(
      "{}: {} in {}, {}\n"
      "  {}, {:.2f} bytes a point; {}\n"
      "  checked from the files: points in their tiles' boxes, boxes in their parents', falling "
      "errors, counts\n",
      job.output.string(), count_of(tiles.tiles, "tile"), count_of(tiles.tilesets, "tileset"),
      count_of(tiles.points, "point"), human_bytes(tiles.content_bytes + tiles.tileset_bytes),
      static_cast<double>(tiles.content_bytes) / static_cast<double>(tiles.points),
      units_of(result));
  std::vector<std::string> left_out = tiles.left_out;
  if (!job.normals && std::erase(left_out, formats::attribute_name::kNormal) > 0)
    text += "  normals are left out; --normals writes them\n";
  if (!left_out.empty())
    text += fmt::format("  left out, as coarse levels do not have them or glTF cannot: {}\n",
                        fmt::join(left_out, ", "));
  if (job.page) text += "  serve this folder by any web server and open index.html\n";
  return text;
}

}  // namespace

TilesExport::TilesExport(CLI::App& parser)
    : threads_(std::max(1U, std::thread::hardware_concurrency())) {
  flags_ = {
      parser
          .add_option("--compression", compression_,
                      "3dtiles: meshopt, or none for clients without it [meshopt]")
          ->option_text("NAME")
          ->check(CLI::IsMember({"meshopt", "none"})),
      parser
          .add_option("--place", place_,
                      "3dtiles: where the middle of the dataset's ground stands on the globe, "
                      "degrees and metres above the ellipsoid [a frame of its own]")
          ->option_text("LON,LAT[,HEIGHT]"),
      parser
          .add_option("--metres-per-unit", metres_per_unit_,
                      "3dtiles: metres in a unit of all coordinates [as the coordinate reference "
                      "system tells of each, else 1]")
          ->option_text("NUMBER")
          ->check(CLI::Range(1e-6, 1e9)),
      parser
          .add_option("--colors-for", colors_for_,
                      "3dtiles: any client, or cesiumjs, whose dark colors are a little off "
                      "otherwise [any]")
          ->option_text("CLIENT")
          ->check(CLI::IsMember({"any", "cesiumjs"})),
      parser.add_flag("--normals", normals_,
                      "3dtiles: write normals; clients then shade the points"),
      parser.add_flag("--no-page", no_page_, "3dtiles: leave out index.html and its script"),
      add_threads_flag(parser, threads_, "3dtiles: ")};
}

void TilesExport::refuse_flags(const std::string& format) const {
  for (const CLI::Option* flag : flags_)
    if (flag->count() > 0)
      formats::throw_usage(flag->get_name() + " is for 3dtiles, not for " + format);
}

void TilesExport::run(const std::function<formats::DatasetReader()>& open, TilesJob job,
                      const std::string& progress_mode, const std::stop_token& stop) const {
  if (compression_ == "none") job.compression = formats::TileCompression::kNone;
  job.color_client = formats::color_client_named(colors_for_).value();
  job.normals = normals_;
  job.page = !no_page_;
  job.threads = threads_;
  if (!place_.empty()) job.place = place_of(place_);
  if (metres_per_unit_ > 0) job.metres_per_unit = metres_per_unit_;
  const TilesResult result = [&] {
    const auto progress = make_progress(*progress_mode_named(progress_mode));
    return make_tiles(job, open, progress.get(), stop);
  }();
  print_results(text_of(result, job));
}

}  // namespace cairn::pipeline
