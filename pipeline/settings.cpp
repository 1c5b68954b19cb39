#include "pipeline/settings.h"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <map>

#include "formats/dataset/tree.h"
#include "formats/error.h"
#include "pipeline/compiled_in.h"
#include "pipeline/config.h"

namespace cairn::pipeline {
namespace {

using formats::Error;
using formats::ErrorKind;

std::string joined(const std::vector<std::string>& values) {
  std::string text;
  for (const std::string& value : values) text += (text.empty() ? "" : ", ") + value;
  return values.empty() ? "nothing" : "'" + text + "'";
}

bool is_pattern(const std::string& text) { return text.find_first_of("*?[") != std::string::npos; }

/// The folder as the part of a pattern that matches its name alone.
std::string escaped(const std::filesystem::path& folder) {
  std::string text;
  for (const char c : folder.string()) {
    if (std::string_view("*?[]\\").find(c) != std::string_view::npos) text += '\\';
    text += c;
  }
  return text;
}

/// The files that a path of a configuration file names: itself, or those that match a pattern, in the order of
/// their bytes.
std::vector<std::string> files_named(const std::filesystem::path& base, const std::string& value,
                                     const GivenValue& given) {
  const std::filesystem::path path = base / value;
  if (!is_pattern(value) || std::filesystem::exists(path)) return {path.string()};
  const std::string pattern = std::filesystem::path(escaped(base)) / value;
  glob_t found{};
  const int result = ::glob(pattern.c_str(), GLOB_NOSORT, nullptr, &found);
  std::vector<std::string> files(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  ::globfree(&found);
  if (result != 0 || files.empty())
    throw Error(ErrorKind::kUsage,
                {.what = given.origin, .found = "no file that matches '" + path.string() + "'"});
  std::sort(files.begin(), files.end());
  return files;
}

/// Paths of a configuration file start from its folder, those of scans from `folder` if that is not empty.
/// Flags are taken as they are. The empty path is left to be refused; joined it would name the folder.
std::vector<std::string> located(const Setting& setting, const GivenValue& given,
                                 const std::filesystem::path& folder) {
  const bool is_path = setting.kind == SettingKind::kPath || setting.kind == SettingKind::kPaths;
  if (!is_path || !given.in_file) return given.values;
  std::vector<std::string> paths;
  // A file that a pattern names is listed once, however many of its list match it.
  std::map<std::filesystem::path, bool> by_pattern;
  for (const std::string& value : given.values) {
    const auto& base = setting.in_folder && !folder.empty() ? folder : given.base;
    if (value.empty() || setting.kind == SettingKind::kPath) {
      paths.push_back(value.empty() ? value : (base / value).string());
      continue;
    }
    const bool pattern = is_pattern(value);
    for (const std::string& file : files_named(base, value, given)) {
      const auto [earlier, fresh] =
          by_pattern.emplace(std::filesystem::path(file).lexically_normal(), pattern);
      if (fresh || !(pattern || earlier->second)) paths.push_back(file);
    }
  }
  return paths;
}

void apply(BuildSettings& settings, const Setting& setting, const GivenValue& given) {
  if (given.values.empty() && setting.kind != SettingKind::kTexts &&
      setting.kind != SettingKind::kPaths)
    throw Error(ErrorKind::kUsage,
                {.what = given.origin, .expected = std::string(setting.allowed)});
  if (!setting.apply(settings, given.values))
    throw Error(ErrorKind::kUsage, {.what = given.origin,
                                    .found = joined(given.values),
                                    .expected = std::string(setting.allowed)});
}

/// Later layers win.
void lay_over(SettingLayer& below, const SettingLayer& above) {
  for (const auto& [key, given] : above) below[key] = given;
}

SettingLayer preset_layer(const SettingLayer& chosen) {
  const auto given = chosen.find("preset");
  if (given == chosen.end()) return {};
  BuildSettings ignored;
  apply(ignored, *find_setting("preset"), given->second);
  const auto preset = std::find_if(presets().begin(), presets().end(), [&](const Preset& p) {
    return p.name == given->second.values.front();
  });
  return parse_config(preset->text, "configs/" + std::string(preset->name) + ".toml", {});
}

/// What one value alone does not tell.
void check_together(const BuildOptions& options) {
  if (options.campaign.scans.empty()) formats::throw_usage("no scans are given");
  if (options.output.empty()) formats::throw_usage("no output is given: -o NAME.cairn");
  if (!options.drop.empty() && !options.keep.empty())
    formats::throw_usage("both drop and keep are given: one of them says it all");
  const std::uint64_t children = options.fanout.value_or(formats::kMinFanout);
  if (options.node_points < children)
    formats::throw_usage(fmt::format(
        "node_points is {}, less than the fan-out {}: every child needs a representative",
        options.node_points, children));
}

/// The `folder` that is given; empty if there is none.
std::filesystem::path folder_of_scans(const SettingLayer& all) {
  const auto given = all.find("folder");
  if (given == all.end() || given->second.values.empty()) return {};
  std::filesystem::path folder = located(*find_setting("folder"), given->second, {}).front();
  if (!folder.empty() && !std::filesystem::is_directory(folder))
    throw Error(ErrorKind::kUsage, {.what = given->second.origin,
                                    .found = "no folder at '" + folder.string() + "'",
                                    .expected = std::string(find_setting("folder")->allowed)});
  return folder;
}

BuildSettings resolve(const SettingLayer& flags,
                      const std::optional<std::filesystem::path>& config) {
  SettingLayer chosen = config ? read_config(*config) : SettingLayer{};
  lay_over(chosen, flags);
  SettingLayer all = preset_layer(chosen);
  lay_over(all, chosen);
  const std::filesystem::path folder = folder_of_scans(all);
  BuildSettings settings;
  for (auto& [key, given] : all) {
    const Setting& setting = *find_setting(key);
    given.values = located(setting, given, folder);
    apply(settings, setting, given);
  }
  return settings;
}

}  // namespace

std::string Setting::flag() const {
  std::string name = "--" + std::string(key);
  std::replace(name.begin() + 2, name.end(), '_', '-');
  return name;
}

const Setting* find_setting(std::string_view key) {
  const auto settings = build_settings();
  const auto at = std::find_if(settings.begin(), settings.end(),
                               [&](const Setting& s) { return s.key == key; });
  return at == settings.end() ? nullptr : &*at;
}

BuildSettings resolve_settings(const SettingLayer& flags,
                               const std::optional<std::filesystem::path>& config) {
  BuildSettings settings = resolve(flags, config);
  check_together(settings.options);
  return settings;
}

CampaignOptions resolve_campaign(const SettingLayer& flags,
                                 const std::optional<std::filesystem::path>& config) {
  return resolve(flags, config).options.campaign;
}

std::string settings_markdown() {
  std::string rows;
  for (const Setting& s : build_settings()) {
    const std::string key = s.flag_only ? "" : fmt::format("`{}` ", s.key);
    const std::string flag = s.key == "scans" ? "SCANS" : "`" + s.flag() + "`";
    rows += fmt::format("| {}{} | {} | {} | {} |\n", key, flag, s.fallback, s.allowed, s.help);
  }
  return rows;
}

}  // namespace cairn::pipeline
