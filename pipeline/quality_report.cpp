#include "pipeline/quality_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "formats/dataset/metadata.h"
#include "formats/file_names.h"
#include "formats/scans/crs.h"
#include "formats/scans/crs_facts.h"
#include "pipeline/dataset_report.h"
#include "pipeline/human.h"
#include "pipeline/json_number.h"
#include "pipeline/level_statistics.h"
#include "pipeline/numerics_report.h"

namespace cairn::pipeline {
namespace {

using Json = nlohmann::ordered_json;

Json spread_json(const Spread& spread) {
  return {{"min", spread.min}, {"median", spread.median}, {"max", spread.max}};
}

Json sizes_json(const LevelStatistics& level) {
  Json histogram = Json::array();
  for (const SizeClass& size : level.sizes)
    histogram.push_back({{"min", size.min}, {"max", size.max}, {"nodes", size.nodes}});
  return {{"min", level.min_points},
          {"mean", level.mean_points},
          {"max", level.max_points},
          {"variation", level.variation},
          {"histogram", std::move(histogram)}};
}

Json bytes_json(const LevelStatistics& level, const std::vector<std::string>& names) {
  Json sections = Json::object();
  for (std::size_t s = 0; s < names.size(); ++s) sections[names[s]] = level.section_bytes[s];
  return sections;
}

Json level_json(const LevelStatistics& level, const std::vector<std::string>& names) {
  return {{"level", level.level},
          {"nodes", level.nodes},
          {"points", level.points},
          {"node_points", sizes_json(level)},
          {"theta", spread_json(level.theta)},
          {"grid", spread_json(level.grid)},
          {"rms", level.level_rms},
          {"node_rms", spread_json(level.rms)},
          {"node_bound", spread_json(level.bound)},
          {"section_bytes", bytes_json(level, names)}};
}

Json run_json(const BuildReport& run) {
  Json stages = Json::array();
  for (const StageTiming& stage : run.stages)
    stages.push_back({{"name", stage.name},
                      {"points", stage.points},
                      {"seconds", stage.seconds},
                      {"cpu_seconds", stage.cpu_seconds},
                      {"peak_memory_bytes", stage.peak_memory_bytes}});
  return {{"elapsed_s", run.elapsed_s},
          {"threads", run.threads},
          {"memory_limit_bytes", run.memory_limit_bytes},
          {"peak_memory_bytes", run.peak_memory_bytes},
          {"input_bytes", run.input_bytes},
          {"stages", std::move(stages)}};
}

Json report_json(const formats::DatasetReader& dataset, const std::filesystem::path& folder,
                 const std::optional<BuildReport>& run) {
  const std::vector<std::string> names = section_names(dataset.header());
  Json levels = Json::array();
  for (const LevelStatistics& level : level_statistics(dataset))
    levels.push_back(level_json(level, names));
  const Json told = Json::parse(dataset_json(dataset));
  Json json{{"dataset", formats::without_trailing_slash(folder).filename().string()},
            {"points", told.at("points")},
            {"read", told.at("read")},
            {"dropped", told.at("dropped")},
            {"missing", told.at("missing")},
            {"bounds", told.at("bounds")},
            {"tree", told.at("tree")},
            {"parameters", told.at("parameters")},
            {"levels", std::move(levels)},
            {"numerics", numerics_json(told)},
            {"sources", told.at("sources")},
            {"crs", told.at("crs")},
            {"run", run ? run_json(*run) : Json(nullptr)}};
  if (told.contains("effects")) json["effects"] = told.at("effects");
  return json;
}

std::string nodes_table(const std::vector<LevelStatistics>& levels) {
  std::string text =
      fmt::format("\nNode sizes\n  {:>5}  {:>9}  {:>10}  {:>12}  {:>10}  {:>9}  {}\n", "level",
                  "nodes", "least", "mean", "most", "variation", "sizes");
  for (const LevelStatistics& level : levels) {
    std::string sizes;
    constexpr std::size_t kShown = 3;
    for (std::size_t i = 0; i < level.sizes.size() && i < kShown; ++i)
      sizes += fmt::format("{}{} of {}", i == 0 ? "" : ", ", with_commas(level.sizes[i].nodes),
                           with_commas(level.sizes[i].min));
    if (level.sizes.size() > kShown) sizes += ", ...";
    text += fmt::format("  {:>5}  {:>9}  {:>10}  {:>12}  {:>10}  {:>9}  {}\n", level.level,
                        with_commas(level.nodes), with_commas(level.min_points),
                        fmt::format("{:.1f}", level.mean_points), with_commas(level.max_points),
                        significant(level.variation, 2), sizes);
  }
  return text;
}

std::string spread_text(const Spread& spread) {
  if (spread.min == spread.max) return significant(spread.max, 4);
  return fmt::format("{} / {} / {}", significant(spread.min, 4), significant(spread.median, 4),
                     significant(spread.max, 4));
}

std::string errors_table(const std::vector<LevelStatistics>& levels) {
  std::string text = fmt::format(
      "\nErrors and merging (of nodes: least / median / most)\n"
      "  {:>5}  {:>10}  {:>30}  {:>30}  {:>18}  {:>16}\n",
      "level", "rms", "rms of a node", "bound of a node", "theta, degrees", "grid");
  for (const LevelStatistics& level : levels)
    text +=
        fmt::format("  {:>5}  {:>10}  {:>30}  {:>30}  {:>18}  {:>16}\n", level.level,
                    significant(level.level_rms, 4), spread_text(level.rms),
                    spread_text(level.bound), spread_text(level.theta), spread_text(level.grid));
  return text;
}

std::string bytes_table(const std::vector<LevelStatistics>& levels,
                        const std::vector<std::string>& names) {
  std::string text = fmt::format("\nBytes a stored point\n  {:<20}  {:>12}", "section", "size");
  for (const LevelStatistics& level : levels)
    text += fmt::format("  {:>7}", "level " + std::to_string(level.level));
  text += "\n";
  for (std::size_t s = 0; s < names.size(); ++s) {
    std::uint64_t total = 0;
    std::string row;
    for (const LevelStatistics& level : levels) {
      total += level.section_bytes[s];
      row += fmt::format("  {:>7.3f}", static_cast<double>(level.section_bytes[s]) /
                                           static_cast<double>(level.points));
    }
    text += fmt::format("  {:<20}  {:>12}{}\n", printable(names[s]), human_bytes(total), row);
  }
  return text;
}

std::string box_text(const Json& bounds) {
  if (!bounds.is_object()) return "nothing kept";
  const auto corner = [](const Json& p) {
    return fmt::format("({:.3f}, {:.3f}, {:.3f})", p.at(0).get<double>(), p.at(1).get<double>(),
                       p.at(2).get<double>());
  };
  return corner(bounds.at("min")) + " to " + corner(bounds.at("max"));
}

/// What the dataset's coordinate system is called; empty if it has none.
std::string crs_text(const formats::DatasetReader& dataset, const std::filesystem::path& folder) {
  std::vector<formats::VariableLengthRecord> records;
  if (const auto error = formats::read_metadata_crs(dataset.metadata(), records))
    refuse_metadata(folder, error->what);
  return printable(formats::crs_name(records));
}

/// Of the coordinate system, as far as it tells them.
std::string units_text(const formats::DatasetReader& dataset) {
  std::vector<formats::VariableLengthRecord> records;
  if (formats::read_metadata_crs(dataset.metadata(), records)) return "";
  const formats::CrsFacts facts = formats::crs_facts(records);
  std::string text;
  if (facts.kind == formats::CrsKind::kGeographic) text += ", degrees";
  if (facts.unit_m) text += ", in units of a " + formats::unit_name(*facts.unit_m);
  if (facts.vertical_unit_m && facts.vertical_unit_m != facts.unit_m)
    text += ", heights in units of a " + formats::unit_name(*facts.vertical_unit_m);
  return text;
}

std::string source_crs_text(const Json& source, const std::string& crs) {
  if (source.contains("replaced_crs")) return "its coordinate system is replaced by " + crs;
  return source.at("crs").empty() ? "no coordinate system" : "with a coordinate system";
}

std::string uncounted_text(const Json& source) {
  if (!source.contains("uncounted_records")) return "";
  const std::uint64_t records = whole_number(source.at("uncounted_records"));
  return fmt::format("; room for {} that its header does not count",
                     count_of(records, "more record"));
}

/// What effects did to a source; nothing if none was called.
std::string effects_text(const Json& report, const Json& source) {
  std::string text;
  const auto add = [&text](const std::string& words) {
    text += (text.empty() ? "" : ", ") + words;
  };
  for (const Json& effect : report.value("effects", Json::array())) {
    const auto name = effect.at("name").get<std::string>();
    if (!effect.contains("attribute"))
      add(with_commas(whole_number(source.at("dropped").at(name))) + " removed as " + name);
  }
  if (source.contains("balance")) {
    const Json& balance = source.at("balance");
    std::string gains;
    for (const Json& gain : balance.at("gain")) gains += " " + significant(gain.get<double>(), 5);
    add("gain" + gains + " (" + count_of(whole_number(balance.at("clamped")), "point") +
        " clamped)");
  }
  return text.empty() ? "" : "      " + printable(text) + "\n";
}

std::string ledger_table(const Json& report, const std::string& crs) {
  std::string text = fmt::format(
      "\nLedger: what became of the scans' records\n"
      "  {:>14}  {:>14}  {:>14}  {:>11}  {:>10}  {:>10}  {}\n",
      "claimed", "read", "kept", "not finite", "no return", "missing", "scan");
  for (const Json& source : report.at("sources")) {
    const auto number = [&](const char* key) { return whole_number(source.at(key)); };
    const auto dropped = [&](const char* key) {
      return whole_number(source.at("dropped").at(key));
    };
    std::uint64_t read = number("kept");
    for (const Json& count : source.at("dropped")) read += whole_number(count);
    text +=
        fmt::format("  {:>14}  {:>14}  {:>14}  {:>11}  {:>10}  {:>10}  {} ({})\n",
                    with_commas(number("claimed")), with_commas(read), with_commas(number("kept")),
                    with_commas(dropped("non_finite")), with_commas(dropped("no_return")),
                    with_commas(number("missing")), printable(source.at("name").get<std::string>()),
                    printable(source.at("format").get<std::string>()));
    text += fmt::format("      {}; {}{}\n", box_text(source.at("bounds")),
                        source_crs_text(source, crs), uncounted_text(source));
    text += effects_text(report, source);
  }
  return text;
}

std::string run_table(const BuildReport& run) {
  std::string text = fmt::format("\nCost of the build\n  {:<12}  {:>15}  {:>9}  {:>9}  {:>11}\n",
                                 "stage", "points", "time", "CPU", "peak memory");
  for (const StageTiming& stage : run.stages)
    text += fmt::format("  {:<12}  {:>15}  {:>9}  {:>9}  {:>11}\n", printable(stage.name),
                        stage.points > 0 ? with_commas(stage.points) : "",
                        human_duration(stage.seconds), human_duration(stage.cpu_seconds),
                        human_bytes(stage.peak_memory_bytes));
  return text + fmt::format("  {} in all, {}, {} of memory at the peak\n",
                            human_duration(run.elapsed_s), count_of(run.threads, "thread"),
                            human_bytes(run.peak_memory_bytes));
}

}  // namespace

std::string quality_text(const formats::DatasetReader& dataset, const std::filesystem::path& folder,
                         const std::optional<BuildReport>& run) try {
  const std::vector<LevelStatistics> levels = level_statistics(dataset);
  const Json report = report_json(dataset, folder, run);
  std::string text = fmt::format(
      "{}\n  {} points of {} read: {} dropped, {} missing\n", printable(folder.string()),
      with_commas(whole_number(report.at("points"))), with_commas(whole_number(report.at("read"))),
      with_commas(whole_number(report.at("dropped"))),
      with_commas(whole_number(report.at("missing"))));
  const std::string crs = crs_text(dataset, folder);
  text +=
      fmt::format("  coordinate system: {}{}\n", crs.empty() ? "none" : crs, units_text(dataset));
  if (const auto bits = formats::read_metadata_color_bits(dataset.metadata()))
    text += fmt::format("  colors: of {} bits in fields of 16\n", *bits);
  text += nodes_table(levels) + errors_table(levels) + numerics_text(report.at("numerics")) +
          bytes_table(levels, section_names(dataset.header())) + ledger_table(report, crs);
  return run ? text + run_table(*run) : text;
} catch (const Json::exception& error) {
  refuse_metadata(folder, error.what());
}

std::string quality_json(const formats::DatasetReader& dataset, const std::filesystem::path& folder,
                         const std::optional<BuildReport>& run) try {
  return report_json(dataset, folder, run).dump(2, ' ', false, Json::error_handler_t::replace);
} catch (const Json::exception& error) {
  refuse_metadata(folder, error.what());
}

}  // namespace cairn::pipeline
