#include "pipeline/study/study_file.h"

#include <fmt/format.h>

#include <set>

#include "formats/error.h"
#include "formats/toml_text.h"
#include "pipeline/checked_table.h"
#include "pipeline/study/study_pictures.h"
#include "pipeline/study/sweep.h"

namespace cairn::pipeline {
namespace {

constexpr std::uint64_t kMostRepetitions = 1000;
constexpr std::uint64_t kMostPoints = 1'000'000'000'000;

std::optional<std::filesystem::path> path_of(const toml::node& node) {
  const auto text = any_text(node);
  return text && !text->empty() ? std::optional<std::filesystem::path>(*text) : std::nullopt;
}

std::optional<std::vector<std::string>> paths_of(const toml::node& node) {
  const toml::array* items = node.as_array();
  std::vector<std::string> paths;
  for (std::size_t i = 0; items != nullptr && i < items->size(); ++i) {
    const auto path = path_of((*items)[i]);
    if (!path) return std::nullopt;
    paths.push_back(path->string());
  }
  return paths.empty() ? std::nullopt : std::optional(paths);
}

std::optional<ErrorPlace> place_of(const toml::node& node) {
  const auto text = formats::scalar_text(node);
  return text ? parse_place(*text) : std::nullopt;
}

StudyInput read_input(CheckedTable table, const std::filesystem::path& folder) {
  const auto located = [&](std::string_view key, std::string_view allowed) {
    auto path = table.find(key, allowed, path_of);
    return path ? std::optional(folder / *path) : std::nullopt;
  };
  StudyInput input;
  input.name = table.need("name", kPlainName, plain_name);
  input.campaign = located("campaign", "the path of a configuration file");
  input.folder = located("folder", "the path of a folder");
  const auto scans = table.find("scans", "an array of paths of scans", paths_of);
  if (scans) input.scans = {*scans, "input " + input.name + ": scans", true, folder};
  input.scene = located("scene", "the path of a scene");
  input.points = table.find("points", "a whole number from 1 to 1e12",
                            [](const auto& node) { return whole_number(node, 1, kMostPoints); });
  table.finish();
  const int sources = (input.campaign ? 1 : 0) + (input.scans ? 1 : 0) + (input.scene ? 1 : 0);
  if (sources != 1) table.refuse("expected one of the keys campaign, scans and scene");
  if (input.folder && !input.campaign) table.refuse("folder asks for a campaign");
  if (input.points && !input.scene) table.refuse("points asks for a scene");
  return input;
}

}  // namespace

bool can_be_studied(const Setting& setting) {
  return setting.group != find_setting("scans")->group &&
         setting.group != find_setting("memory")->group;
}

StudyFile parse_study(std::string_view text, const std::filesystem::path& file) {
  const toml::table root = formats::parse_toml(text, file.string());
  CheckedTable table(root, file, "");
  StudyFile study;
  study.name = table.find("name", kPlainName, plain_name).value_or(plain_stem(file, "study"));
  const auto repetitions =
      table.find("repetitions", "a whole number from 1 to 1000",
                 [](const auto& node) { return whole_number(node, 1, kMostRepetitions); });
  study.repetitions = repetitions.value_or(study.repetitions);
  study.at = table.find("at", kPlaceChoices, place_of).value_or(study.at);
  const Tables inputs = table.need("input", "at least one table [[input]]", some_tables);
  SweepTables sweep;
  sweep.fixed = table.find("settings", "a table [settings]", any_table).value_or(nullptr);
  sweep.swept = table.find("sweep", "a table [sweep]", any_table).value_or(nullptr);
  sweep.single = table.find("setting", "tables [[setting]]", some_tables).value_or(Tables{});
  const auto pictures = table.find("pictures", "a table [pictures]", any_table);
  table.finish();
  if (pictures) study.pictures = read_pictures({**pictures, file, "pictures"});
  std::set<std::string> names;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    CheckedTable input(*inputs[i], file, fmt::format("input {}", i + 1));
    study.inputs.push_back(read_input(input, file.parent_path()));
    if (!names.insert(study.inputs.back().name).second)
      input.refuse("two inputs have the name " + study.inputs.back().name);
  }
  study.settings = expand_sweep(sweep, file);
  return study;
}

StudyFile read_study(const std::filesystem::path& file) {
  return parse_study(formats::read_toml_text(file), file);
}

}  // namespace cairn::pipeline
