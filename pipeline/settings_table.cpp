// The table itself. To add a setting: a member of BuildOptions, a row here, and the row that the tests
// then ask for in the README.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <sstream>

#include "formats/dataset/codec.h"
#include "formats/dataset/tree.h"
#include "formats/scans/crs.h"
#include "formats/scans/text_layout.h"
#include "pipeline/compiled_in.h"
#include "pipeline/memory_budget.h"
#include "pipeline/settings.h"
#include "stages/cluster/reducer.h"

namespace cairn::pipeline {
namespace {

using Values = std::vector<std::string>;

/// Rounding the number of levels may make nodes up to sqrt(64) = 8 times larger than asked for; that still is
/// no more than kMaxNodePoints of formats/dataset/record_codec.h.
constexpr std::uint64_t kMostNodePoints = std::uint64_t{1} << 21;
constexpr std::uint64_t kMostGrid = 65536;
constexpr std::uint64_t kMostThreads = 1024;
constexpr std::uint64_t kMostNeighbors = 1024;
constexpr std::uint64_t kMostRefinement = 64;

/// The member that pointers to members lead to, one inside the other.
template <auto kMember, auto... kInside>
auto& member(auto& of) {
  if constexpr (sizeof...(kInside) == 0)
    return of.*kMember;
  else
    return member<kInside...>(of.*kMember);
}

/// The whole text as a T.
template <typename T>
std::optional<T> parse(const std::string& text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

template <typename Target>
bool set_integer(Target& target, const Values& values, std::uint64_t least, std::uint64_t most) {
  const auto value = parse<std::uint64_t>(values.front());
  if (!value || *value < least || *value > most) return false;
  target = static_cast<Target>(*value);
  return true;
}

bool set_integer_or_auto(std::optional<std::uint32_t>& target, const Values& values,
                         std::uint64_t least, std::uint64_t most) {
  if (values.front() == "auto") {
    target.reset();
    return true;
  }
  std::uint32_t value = 0;
  if (!set_integer(value, values, least, most)) return false;
  target = value;
  return true;
}

template <typename Target, typename Accept>
bool set_number(Target& target, const Values& values, Accept accept) {
  const auto value = parse<double>(values.front());
  if (!value || !std::isfinite(*value) || !accept(*value)) return false;
  target = *value;
  return true;
}

template <auto... kMember>
bool set_switch(BuildSettings& s, const Values& v) {
  member<kMember...>(s.options) = v.front() == "true";
  return v.front() == "true" || v.front() == "false";
}

template <auto... kMember>
bool set_path(BuildSettings& s, const Values& v) {
  member<kMember...>(s.options) = v.front();
  return !v.front().empty();
}

template <auto kMember, std::uint64_t kLeast, std::uint64_t kMost>
bool set_integer(BuildSettings& s, const Values& v) {
  return set_integer(s.options.*kMember, v, kLeast, kMost);
}

template <auto kMember, std::uint64_t kLeast, std::uint64_t kMost>
bool set_integer_or_auto(BuildSettings& s, const Values& v) {
  return set_integer_or_auto(s.options.*kMember, v, kLeast, kMost);
}

template <auto kMember>
bool set_names(BuildSettings& s, const Values& v) {
  std::vector<std::string>& names = s.options.*kMember;
  names = v;
  std::replace(names.begin(), names.end(), std::string("colour"), std::string("color"));
  return std::none_of(v.begin(), v.end(),
                      [](const std::string& name) { return name.empty() || name == "position"; });
}

bool set_scans(BuildSettings& s, const Values& v) {
  s.options.campaign.scans.assign(v.begin(), v.end());
  return std::find(v.begin(), v.end(), "") == v.end();
}

/// Has had its effect when paths were located.
bool set_folder(BuildSettings&, const Values& v) { return !v.front().empty(); }

bool is_preset(BuildSettings&, const Values& v) {
  return std::any_of(presets().begin(), presets().end(),
                     [&](const Preset& p) { return p.name == v.front(); });
}

bool set_reducer(BuildSettings& s, const Values& v) {
  s.options.reducer = v.front();
  const auto names = stages::reducer_names();
  return std::find(names.begin(), names.end(), v.front()) != names.end();
}

bool set_theta(BuildSettings& s, const Values& v) {
  return set_number(s.options.theta_degrees, v, [](double x) { return x >= 0 && x <= 180; });
}

bool set_relaxation(BuildSettings& s, const Values& v) {
  return set_number(s.options.theta_relaxation, v, [](double x) { return x > 1; });
}

bool set_codec(BuildSettings& s, const Values& v) {
  const auto codec = formats::codec_named(v.front());
  if (codec) s.options.codec = *codec;
  return codec.has_value();
}

bool set_poses_tell(BuildSettings& s, const Values& v) {
  s.options.campaign.poses_tell_sensors_only = v.front() == "sensors";
  return v.front() == "sensors" || v.front() == "placement";
}

bool set_crs(BuildSettings& s, const Values& v) {
  s.options.crs = v.front();
  return formats::crs_records(v.front()).has_value();
}

bool set_estimate(BuildSettings& s, const Values& v) {
  const auto named = [&](std::string_view name) {
    return std::find(v.begin(), v.end(), name) != v.end();
  };
  s.options.estimate_normals = named("normals");
  s.options.estimate_radii = named("radii");
  return std::all_of(v.begin(), v.end(),
                     [](const std::string& name) { return name == "normals" || name == "radii"; });
}

bool set_duplicates(BuildSettings& s, const Values& v) {
  using stages::Duplicates;
  stages::FilterOptions& filter = s.options.filter;
  filter.duplicates = v.front() == "position" ? Duplicates::kPosition
                      : v.front() == "exact"  ? Duplicates::kExact
                                              : Duplicates::kKept;
  return filter.duplicates != Duplicates::kKept || v.front() == "none";
}

bool set_outlier_deviations(BuildSettings& s, const Values& v) {
  return set_number(s.options.filter.outlier_deviations, v, [](double x) { return x >= 0; });
}

bool set_outlier_neighbors(BuildSettings& s, const Values& v) {
  return set_integer(s.options.filter.outlier_neighbors, v, 1, kMostNeighbors);
}

bool set_thin(BuildSettings& s, const Values& v) {
  return set_number(s.options.filter.thin, v, [](double x) { return x > 0; });
}

bool set_resolution(BuildSettings& s, const Values& v) {
  return set_number(s.options.resolution, v, [](double x) { return x > 0; });
}

bool set_columns(BuildSettings& s, const Values& v) {
  s.options.campaign.columns.clear();
  for (const std::string& part : v) {
    std::istringstream names(part);
    for (std::string name; names >> name;) s.options.campaign.columns.push_back(name);
  }
  return formats::find_position(s.options.campaign.columns).has_value();
}

bool set_memory(BuildSettings& s, const Values& v) {
  const auto bytes = parse_memory(v.front(), machine_memory_bytes());
  if (bytes) s.options.memory_bytes = *bytes;
  return bytes && *bytes >= kLeastMemoryBytes;
}

bool set_threads(BuildSettings& s, const Values& v) {
  std::optional<std::uint32_t> threads;
  if (!set_integer_or_auto(threads, v, 1, kMostThreads)) return false;
  s.options.threads = threads.value_or(0);
  return true;
}

bool set_progress(BuildSettings& s, const Values& v) {
  const auto mode = progress_mode_named(v.front());
  if (mode) s.progress = *mode;
  return mode.has_value();
}

using enum SettingKind;
constexpr std::string_view kInOut = "Input and output";
constexpr std::string_view kTree = "Tree";
constexpr std::string_view kEffects = "Effects";
constexpr std::string_view kEstimation = "Estimation";
constexpr std::string_view kSimplification = "Simplification";
constexpr std::string_view kStorage = "Storage";
constexpr std::string_view kResources = "Resources";
constexpr std::string_view kBoolean = "true or false";

constexpr auto kSettings = std::to_array<Setting>({
    {"scans", kPaths, kInOut, "SCANS", "paths of scans", "", "scans to convert, in this order",
     set_scans, /*flag_only=*/false, /*in_folder=*/true},
    {"folder", kPath, kInOut, "DIR", "a path of a folder", "the configuration file's",
     "where the relative scans and poses of a configuration file start", set_folder},
    {"output", kPath, kInOut, "NAME.cairn", "a path", "", "the dataset to make, a folder",
     set_path<&BuildOptions::output>},
    {"preset", kText, kInOut, "NAME", "default, preview or archive", "default",
     "start from these settings", is_preset},
    {"poses", kPath, kInOut, "FILE", "a path of a table of poses or a Stanford .conf file",
     "the scans' own", "where the scans stand; see \"Poses\"",
     set_path<&BuildOptions::campaign, &CampaignOptions::poses>, /*flag_only=*/false,
     /*in_folder=*/true},
    {"poses_tell", kText, kInOut, "WHAT", "placement or sensors", "placement",
     "whether poses place the scans, or only tell where the sensors stood", set_poses_tell},
    {"crs", kText, kInOut, "CRS", "EPSG:number (projected or geographic) or WKT", "the scans' own",
     "coordinate reference system, instead of what the scans tell", set_crs},
    {"mixed_crs", kSwitch, kInOut, "", kBoolean, "false",
     "take scans of different coordinate systems or units as they are, instead of refusing them",
     set_switch<&BuildOptions::mixed_crs>},
    {"keep", kTexts, kInOut, "NAME", "names of attributes, such as color or gps_time", "all",
     "attribute to keep, all others are left out; may be repeated", set_names<&BuildOptions::keep>},
    {"drop", kTexts, kInOut, "NAME", "names of attributes, such as color or gps_time", "none",
     "attribute to leave out; may be repeated", set_names<&BuildOptions::drop>},
    {"resolution", kNumber, kInOut, "LENGTH", "a number above 0", "the input's own",
     "accept positions rounded to steps up to this long (world units)", set_resolution},
    {"allow_truncated", kSwitch, kInOut, "", kBoolean, "false",
     "keep the whole records of files that end early",
     set_switch<&BuildOptions::campaign, &CampaignOptions::allow_truncated>},
    {"columns", kTexts, kInOut, "NAMES", "names of columns, such as \"x y z intensity\"",
     "recognised", "columns of text scans; _ leaves one out; see \"Text\"", set_columns},
    {"fanout", kIntegerOrAuto, kTree, "N|auto", "an integer from 2 to 64, or auto", "auto",
     "children of an inner node; auto: the one of 2 to 8 that fits node_points best",
     set_integer_or_auto<&BuildOptions::fanout, formats::kMinFanout, formats::kMaxFanout>},
    {"node_points", kInteger, kTree, "COUNT", "an integer from 2 to 2097152", "65536",
     "points a node should hold",
     set_integer<&BuildOptions::node_points, formats::kMinFanout, kMostNodePoints>},
    {"remove_duplicates", kText, kEffects, "WHICH", "none, position or exact", "none",
     "of points of one position (exact: and the same attributes) keep the first; see \"Effects\"",
     set_duplicates},
    {"outlier_deviations", kNumber, kEffects, "FACTOR", "a number from 0", "no removal",
     "remove points farther from their neighbors than the mean by so many standard deviations",
     set_outlier_deviations},
    {"outlier_neighbors", kInteger, kEffects, "COUNT", "an integer from 1 to 1024", "8",
     "positions around a point that outliers are told by", set_outlier_neighbors},
    {"balance_exposure", kSwitch, kEffects, "", kBoolean, "false",
     "give scans gains of color (or intensity) that make them agree where they overlap",
     set_switch<&BuildOptions::filter, &stages::FilterOptions::balance_exposure>},
    {"thin", kNumber, kEffects, "LENGTH", "a number above 0", "no thinning",
     "keep one point in each cell of this side (world units)", set_thin},
    {"estimate", kTexts, kEstimation, "WHAT", "normals or radii", "nothing",
     "what to estimate from the nearest neighbors; may be repeated", set_estimate},
    {"neighbors", kInteger, kEstimation, "COUNT", "an integer from 3 to 1024", "16",
     "positions that an estimate looks at, the point's own included",
     set_integer<&BuildOptions::neighbors, 3, kMostNeighbors>},
    {"reducer", kText, kSimplification, "NAME", "cluster, average, weighted, first or random",
     "cluster", "how representatives of finer points are chosen", set_reducer},
    {"grid", kIntegerOrAuto, kSimplification, "K|auto", "an integer from 1 to 65536, or auto",
     "auto",
     "cells along the longest axis; auto: about 16 points a cell (fewer cells cost time for less "
     "error)",
     set_integer_or_auto<&BuildOptions::grid, 1, kMostGrid>},
    {"theta", kNumber, kSimplification, "DEGREES", "a number from 0 to 180", "15",
     "largest angle between normals that are merged", set_theta},
    {"theta_relaxation", kNumber, kSimplification, "FACTOR", "a number above 1", "1.5",
     "theta grows by this factor, by 1 degree at least, where nothing else can be merged",
     set_relaxation},
    {"refinement", kInteger, kSimplification, "PASSES", "an integer from 0 to 64", "2",
     "passes of cluster in which points move to the nearest representative",
     set_integer<&BuildOptions::refinement, 0, kMostRefinement>},
    {"position_bits", kInteger, kStorage, "BITS", "an integer from 1 to 32", "16",
     "bits of a coordinate inside its node's box",
     set_integer<&BuildOptions::position_bits, 1, 32>},
    {"lossless_leaves", kSwitch, kStorage, "", kBoolean, "false",
     "keep the finest level on the dataset's grid; exact for LAS of common scales",
     set_switch<&BuildOptions::lossless_leaves>},
    {"codec", kText, kStorage, "NAME", "none, lzo, lzo999 or zstd", "lzo",
     "compression of the sections", set_codec},
    {"memory", kSize, kResources, "SIZE",
     "a size of at least 64MiB, such as 4GiB, or a share such as 50%", "50%",
     "bound of resident memory", set_memory},
    {"threads", kIntegerOrAuto, kResources, "COUNT", "an integer from 1 to 1024, or auto", "auto",
     "workers; auto: one a processor", set_threads},
    {"scratch", kPath, kResources, "DIR", "a path of a folder", "beside the output",
     "where bulky work arrays go", set_path<&BuildOptions::scratch>},
    {"progress", kText, kResources, "MODE", kProgressModeChoices, "auto",
     "how progress is shown on stderr", set_progress},
    {"force", kSwitch, kInOut, "", kBoolean, "false",
     "replace an existing dataset once the new one is complete", set_switch<&BuildOptions::force>,
     /*flag_only=*/true},
    {"fresh", kSwitch, kInOut, "", kBoolean, "false",
     "start over, and not go on with what an interrupted build has done",
     set_switch<&BuildOptions::fresh>,
     /*flag_only=*/true},
});

}  // namespace

std::span<const Setting> build_settings() { return kSettings; }

}  // namespace cairn::pipeline
