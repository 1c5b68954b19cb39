#include "pipeline/dataset_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "formats/error.h"
#include "pipeline/human.h"
#include "pipeline/json_number.h"

namespace cairn::pipeline {
namespace {

using Json = nlohmann::ordered_json;

Json full_metadata(const formats::DatasetReader& dataset) {
  Json json = Json::parse(dataset.metadata());
  const std::uint64_t nodes = dataset.head().nodes_size_bytes;
  const std::uint64_t index = dataset.index_size_bytes();
  const std::uint64_t metadata = dataset.head().metadata_size_bytes;
  Json& bytes = json["bytes"];
  if (!bytes.is_object()) bytes = Json::object();
  bytes["nodes"] = nodes;
  bytes["index"] = index;
  bytes["metadata"] = metadata;
  bytes["total"] = nodes + index + metadata;
  return json;
}

std::uint64_t number(const Json& json, const char* key) {
  return json.is_object() && !json.contains(key) ? 0 : whole_number(json.at(key));
}

std::string line(const char* name, const std::string& text) {
  return fmt::format("  {:<12}{}\n", name, text);
}

std::string points_line(const Json& json) {
  const std::size_t scans = json.value("sources", Json::array()).size();
  std::string text = fmt::format("{} kept of {} read", with_commas(number(json, "points")),
                                 with_commas(number(json, "read")));
  if (scans > 0) text += " from " + count_of(scans, "scan");
  text += fmt::format("; {} dropped, {} missing", with_commas(number(json, "dropped")),
                      with_commas(number(json, "missing")));
  return line("points", text);
}

/// Words after a name, broken into aligned lines; nothing without words.
std::string wrapped_line(const char* name, const std::vector<std::string>& words) {
  constexpr std::size_t kColumns = 88;
  std::string lines;
  std::string row;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string word = printable(words[i]) + (i + 1 < words.size() ? "," : "");
    if (!row.empty() && row.size() + word.size() >= kColumns) {
      lines += line(lines.empty() ? name : "", row);
      row.clear();
    }
    row += (row.empty() ? "" : " ") + word;
  }
  return words.empty() ? "" : lines + line(lines.empty() ? name : "", row);
}

/// What the effects did that the build called for, in their order.
std::string effects_lines(const Json& json) {
  std::vector<std::string> words;
  for (const Json& effect : json.value("effects", Json::array()))
    words.push_back(effect.at("name").get<std::string>() + " " +
                    (effect.contains("attribute")
                         ? "of " + effect.at("attribute").get<std::string>() + " balanced"
                         : with_commas(number(effect, "removed")) + " removed"));
  return wrapped_line("effects", words);
}

std::string schema_lines(const Json& json) {
  std::vector<std::string> words{"position"};
  for (const Json& attribute : json.at("schema")) {
    words.push_back(attribute.at("name").get<std::string>() + " " +
                    attribute.at("type").get<std::string>());
    if (const auto n = whole_number(attribute.at("components")); n > 1)
      words.back() += fmt::format(" x {}", n);
    if (attribute.value("estimated", false)) words.back() += " (estimated)";
    if (attribute.contains("bits"))
      words.back() += fmt::format(" of {} bits", whole_number(attribute.at("bits")));
  }
  return wrapped_line("attributes", words);
}

/// Digits behind the point that tell a step of the grid apart.
int decimals_of(double step) {
  const double digits = std::ceil(-std::log10(step));  // anything, where the metadata is hostile
  return digits > 0 ? static_cast<int>(std::min(digits, 12.0)) : 0;
}

std::string bounds_lines(const Json& json) {
  const Json& low = json.at("bounds").at("min");
  const Json& high = json.at("bounds").at("max");
  const Json& step = json.at("grid").at("step");
  std::string text;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto least = low.at(axis).get<double>();
    const auto most = high.at(axis).get<double>();
    const auto length = step.at(axis).get<double>();
    text +=
        line(axis == 0 ? "bounds" : "",
             fmt::format("{}  {:>17.{}f} to {:>17.{}f}, in steps of {}", "xyz"[axis], least,
                         decimals_of(length), most, decimals_of(length), significant(length, 6)));
  }
  return text;
}

std::string range_text(const Json& range) {
  const std::uint64_t least = number(range, "min");
  const std::uint64_t most = number(range, "max");
  return least == most ? with_commas(most) : with_commas(least) + " to " + with_commas(most);
}

std::string tree_lines(const Json& json) {
  const Json& tree = json.at("tree");
  std::string text = line("tree", fmt::format("fan-out {}, {}, {}", number(tree, "fanout"),
                                              count_of(number(tree, "levels"), "level"),
                                              count_of(number(tree, "nodes"), "node")));
  std::string sizes = range_text(tree.at("leaf_points")) + " points a leaf";
  if (tree.at("inner_points").is_object())
    sizes += ", " + range_text(tree.at("inner_points")) + " an inner node";
  return text + line("node size", sizes + fmt::format(" (asked for {})",
                                                      with_commas(number(tree, "target_points"))));
}

std::string size_line(const Json& json, std::uint64_t stored_points) {
  const Json& bytes = json.at("bytes");
  const auto total = static_cast<double>(number(bytes, "total"));
  return line(
      "size",
      fmt::format("{} ({} nodes, {} index), {:.2f} bytes a stored point, {:.2f} a kept one",
                  human_bytes(number(bytes, "total")), human_bytes(number(bytes, "nodes")),
                  human_bytes(number(bytes, "index")), total / static_cast<double>(stored_points),
                  total / static_cast<double>(number(json, "points"))));
}

std::string settings_lines(const Json& json) {
  std::vector<std::string> words;
  for (const auto& [key, value] : json.at("parameters").items())
    if (!value.is_null() && !value.empty())
      words.push_back(key + " " + (value.is_string() ? value.get<std::string>() : value.dump()));
  return wrapped_line("settings", words);
}

std::string levels_table(const Json& json) {
  std::string text = fmt::format("\n  {:>5}  {:>9}  {:>15}  {:>11}  {:>11}  {:>11}  {:>11}\n",
                                 "level", "nodes", "points", "size", "bytes/point", "rms", "bound");
  for (const Json& level : json.at("levels")) {
    const auto points = number(level, "points");
    text += fmt::format("  {:>5}  {:>9}  {:>15}  {:>11}  {:>11.2f}  {:>11}  {:>11}\n",
                        number(level, "level"), with_commas(number(level, "nodes")),
                        with_commas(points), human_bytes(number(level, "bytes")),
                        static_cast<double>(number(level, "bytes")) / static_cast<double>(points),
                        significant(level.at("rms").get<double>(), 4),
                        significant(level.at("bound").get<double>(), 4));
  }
  return text;
}

std::uint64_t stored_points(const Json& json) {
  std::uint64_t sum = 0;
  for (const Json& level : json.at("levels")) sum += number(level, "points");
  return sum;
}

/// A step that handles no points, such as opening the scans, has a time alone.
std::string timing_row(const std::string& name, std::uint64_t points, double seconds) {
  if (points == 0) return fmt::format("  {:<12}{:>15}  {:>9}\n", name, "", human_duration(seconds));
  return fmt::format("  {:<12}{:>15}  {:>9}  {:>17}\n", name, with_commas(points),
                     human_duration(seconds),
                     seconds > 0 ? human_rate(static_cast<double>(points) / seconds) : "");
}

}  // namespace

std::string dataset_json(const formats::DatasetReader& dataset) {
  return full_metadata(dataset).dump(2);
}

std::string dataset_text(const formats::DatasetReader& dataset,
                         const std::filesystem::path& folder) try {
  const Json json = full_metadata(dataset);
  return printable(folder.string()) + "\n" + points_line(json) + effects_lines(json) +
         schema_lines(json) + bounds_lines(json) + tree_lines(json) +
         size_line(json, stored_points(json)) + settings_lines(json) + levels_table(json);
} catch (const Json::exception& error) {
  refuse_metadata(folder, error.what());
}

void refuse_metadata(const std::filesystem::path& folder, const std::string& found) {
  formats::throw_input({.what = "the metadata lacks what its format demands",
                        .path = folder / formats::dataset_file::kMetadata,
                        .found = found});
}

std::string build_text(const BuildReport& report, std::uint64_t points) {
  std::string text =
      fmt::format("  {:<12}{:>15}  {:>9}  {:>17}\n", "stage", "points", "time", "rate");
  for (const StageTiming& stage : report.stages)
    text += timing_row(printable(stage.name), stage.points, stage.seconds);
  text += timing_row("whole build", points, report.elapsed_s);
  return text + fmt::format("  {} of input, {}, peak memory {} of {} allowed\n",
                            human_bytes(report.input_bytes), count_of(report.threads, "thread"),
                            human_bytes(report.peak_memory_bytes),
                            human_bytes(report.memory_limit_bytes));
}

}  // namespace cairn::pipeline
