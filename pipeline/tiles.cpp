#include "pipeline/tiles.h"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>
#include <system_error>
#include <vector>

#include "formats/dataset/metadata.h"
#include "formats/error.h"
#include "formats/file_names.h"
#include "formats/output_file.h"
#include "formats/random_access_file.h"
#include "formats/resource_folder.h"
#include "formats/scans/crs.h"
#include "formats/scans/crs_facts.h"
#include "pipeline/locked_folder.h"
#include "pipeline/memory_budget.h"
#include "pipeline/publish.h"
#include "stages/parallel.h"

namespace cairn::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTileset = "tileset.json";
constexpr const char* kTiles = "tiles";
/// How every root tileset of ours begins, which tells its folder from those of others.
constexpr std::string_view kMadeBy =
    "{\n \"asset\": {\n  \"version\": \"1.1\",\n  \"generator\": \"Cairn\"";
constexpr std::array<const char*, 4> kPageFiles{"index.html", "page.js", "page.css",
                                                "licenses.txt"};

bool begins_with_ours(const fs::path& tileset) {
  std::array<char, kMadeBy.size()> text{};
  const formats::RandomAccessFile file(tileset);
  return file.read_at_most(0, std::as_writable_bytes(std::span(text))) == text.size() &&
         std::string_view(text.data(), text.size()) == kMadeBy;
}

bool all_digits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// Whether this is tiles/LEVEL or tiles/LEVEL/INDEX.glb (.json).
bool is_tile_entry(const fs::directory_entry& entry) {
  const fs::path& path = entry.path();
  if (!all_digits(path.stem().string())) return false;
  if (entry.symlink_status().type() == fs::file_type::directory) return path.extension().empty();
  return entry.symlink_status().type() == fs::file_type::regular &&
         (path.extension() == ".glb" || path.extension() == ".json");
}

/// Throws kUsage for a folder that holds anything that this does not make.
void require_tiles_or_nothing(const fs::path& output) {
  if (!fs::exists(fs::symlink_status(output))) return;
  const std::string refusal =
      "--force replaces 3D Tiles of ours only, and " + output.string() + " ";
  if (!fs::is_directory(output) || fs::is_symlink(output))
    formats::throw_usage(refusal + "is not a folder");
  if (!fs::is_regular_file(output / kTileset) || !begins_with_ours(output / kTileset))
    formats::throw_usage(refusal + "holds no " + kTileset + " of Cairn's");
  for (const auto& entry : fs::directory_iterator(output)) {
    const std::string name = entry.path().filename().string();
    if (name != kTileset && name != kTiles &&
        std::ranges::find(kPageFiles, name) == kPageFiles.end())
      formats::throw_usage(refusal + "holds " + name + ", which is no part of them");
  }
  if (fs::is_directory(output / kTiles))
    for (const auto& entry : fs::recursive_directory_iterator(output / kTiles))
      if (!is_tile_entry(entry))
        formats::throw_usage(refusal + "holds " + entry.path().lexically_relative(output).string() +
                             ", which is no part of them");
}

fs::path page_folder() {
  fs::path folder;
  for (const char* file : kPageFiles)
    folder = formats::resource_folder("tiles-page", file, "the page of 3D Tiles (or --no-page)");
  return folder;
}

std::vector<std::byte> read_whole(const fs::path& path) {
  const formats::RandomAccessFile file(path);
  std::vector<std::byte> bytes(file.size_bytes());
  file.read_exactly(0, bytes);
  return bytes;
}

stages::TileSink sink_into(const fs::path& folder) {
  return [folder](const std::string& path, std::span<const std::byte> bytes) {
    const fs::path place = folder / path;
    std::error_code failed;
    fs::create_directories(place.parent_path(), failed);
    if (failed)
      formats::throw_system("cannot make the folder", place.parent_path(), failed.value());
    formats::OutputFile::create(place).append(bytes);
  };
}

stages::TileSource source_from(const fs::path& folder) {
  return [folder](const std::string& path) -> std::optional<std::vector<std::byte>> {
    if (!fs::is_regular_file(folder / path)) return std::nullopt;
    return read_whole(folder / path);
  };
}

/// Metres in a unit of each axis.
std::array<double, 3> units_of(const formats::CrsFacts& facts, std::optional<double> given) {
  const double length = given.value_or(facts.unit_m.value_or(1));
  // Where that of the heights alone is told, they would be scaled against the rest.
  const bool own_heights = !given && facts.unit_m && facts.kind != formats::CrsKind::kGeocentric;
  return {length, length, own_heights ? facts.vertical_unit_m.value_or(length) : length};
}

/// Throws where the metadata's records are damaged.
formats::CrsFacts facts_of(const TilesJob& job, const formats::DatasetReader& dataset) {
  std::vector<formats::VariableLengthRecord> records;
  if (const auto error = formats::read_metadata_crs(dataset.metadata(), records))
    formats::throw_input({.what = error->what,
                          .path = job.dataset / formats::dataset_file::kMetadata,
                          .offset = error->byte_offset,
                          .found = error->found,
                          .expected = error->expected});
  return formats::crs_facts(records);
}

stages::TilesOptions options_of(const TilesJob& job, const formats::CrsFacts& facts) {
  const bool geocentric = facts.kind == formats::CrsKind::kGeocentric;
  if (facts.kind == formats::CrsKind::kGeographic)
    formats::throw_usage("coordinates of " + facts.name +
                         " are degrees; 3D Tiles take metres, projected or Earth-centred");
  if (geocentric && job.place)
    formats::throw_usage("--place is for coordinates that are not Earth-centred; those of " +
                         job.dataset.string() + " stand where they say");
  return {.compression = job.compression,
          .color_client = job.color_client,
          .normals = job.normals,
          .unit_m = units_of(facts, job.metres_per_unit),
          .geocentric = geocentric,
          .place = job.place,
          .crs = facts.name};
}

/// The finished folder takes its place.
void publish(const fs::path& folder, const fs::path& output, bool force) {
  require_tiles_or_nothing(output);
  // Tiles can be made again: no note is kept of where the old ones step aside.
  if (force && fs::exists(fs::symlink_status(output)))
    publish_over(
        folder, output, [](const fs::path&) {}, Renames::of_system());
  else
    publish_new(folder, output);
}

}  // namespace

TilesResult make_tiles(const TilesJob& job, const std::function<formats::DatasetReader()>& open,
                       stages::ProgressSink* progress, const std::stop_token& stop) {
  const fs::path output = formats::without_trailing_slash(job.output);
  require_free_place(output, job.force);
  if (job.force) require_tiles_or_nothing(output);
  const fs::path page = job.page ? page_folder() : fs::path();
  const auto dataset = open();
  const formats::CrsFacts facts = facts_of(job, dataset);
  const stages::TilesOptions options = options_of(job, facts);
  const stages::Context context{.threads = job.threads,
                                .memory_bytes = memory_budget(0, machine_memory_bytes()),
                                .make_array = {},
                                .progress = progress,
                                .stop = stop};
  const LockedFolder work(output.string() + ".work", "export of " + output.string());
  const fs::path folder = work.path() / "new";
  const stages::TileSink sink = sink_into(folder);
  TilesResult result{.tiles = stages::export_tiles(context, dataset, options, sink),
                     .unit_m = options.unit_m,
                     .unit_is_told = job.metres_per_unit || facts.unit_m || options.geocentric};
  if (job.page)
    for (const char* file : kPageFiles) sink(file, read_whole(page / file));
  result.check = stages::check_tiles(context, source_from(folder), dataset.header().points,
                                     result.tiles.worker_bytes);
  stages::throw_if_stopped(context);
  publish(folder, output, job.force);
  return result;
}

}  // namespace cairn::pipeline
