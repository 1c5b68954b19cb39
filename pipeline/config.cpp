#include "pipeline/config.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include "formats/error.h"
#include "formats/toml_text.h"
#include "pipeline/config_table.h"
#include "pipeline/words.h"

namespace cairn::pipeline {
namespace {

using formats::Error;
using formats::ErrorKind;

[[noreturn]] void refuse_key(const std::string& where, std::string_view key) {
  std::vector<std::string_view> keys;
  for (const Setting& setting : build_settings())
    if (!setting.flag_only) keys.push_back(setting.key);
  const std::string_view nearest = nearest_word(key, keys);
  const Setting* known = find_setting(key);
  if (known != nullptr)
    formats::throw_usage(fmt::format("{}: '{}' is a flag only: {}", where, key, known->flag()));
  const std::string hint = nearest.empty() ? fmt::format("keys are {}", fmt::join(keys, ", "))
                                           : fmt::format("did you mean '{}'?", nearest);
  formats::throw_usage(fmt::format("{}: unknown key '{}'; {}", where, key, hint));
}

bool has_type(const toml::node& node, SettingKind kind) {
  switch (kind) {
    case SettingKind::kSwitch:
      return node.is_boolean();
    case SettingKind::kInteger:
      return node.is_integer();
    case SettingKind::kIntegerOrAuto:
      return node.is_integer() || (node.is_string() && node.as_string()->get() == "auto");
    case SettingKind::kNumber:
      return node.is_integer() || node.is_floating_point();
    case SettingKind::kSize:
      return node.is_integer() || node.is_string();
    default:
      return node.is_string();
  }
}

bool is_list(SettingKind kind) {
  return kind == SettingKind::kTexts || kind == SettingKind::kPaths;
}

std::string allowed_in_file(const Setting& setting) {
  switch (setting.kind) {
    case SettingKind::kText:
    case SettingKind::kPath:
      return "a string: " + std::string(setting.allowed);
    case SettingKind::kTexts:
    case SettingKind::kPaths:
      return "an array of strings: " + std::string(setting.allowed);
    default:
      return std::string(setting.allowed);
  }
}

}  // namespace

const Setting& setting_of_key(std::string_view key, const std::string& where) {
  const Setting* setting = find_setting(key);
  if (setting == nullptr || setting->flag_only) refuse_key(where, key);
  return *setting;
}

std::vector<std::string> setting_values(const toml::node& node, const Setting& setting,
                                        const std::string& origin) {
  const toml::array* list = is_list(setting.kind) ? node.as_array() : nullptr;
  std::vector<const toml::node*> items;
  if (list != nullptr)
    for (const toml::node& item : *list) items.push_back(&item);
  else
    items.push_back(&node);
  std::vector<std::string> values;
  for (const toml::node* item : items) {
    if (!has_type(*item, setting.kind))
      throw Error(ErrorKind::kUsage, {.what = origin,
                                      .found = formats::described(*item),
                                      .expected = allowed_in_file(setting)});
    values.push_back(*formats::scalar_text(*item));
  }
  return values;
}

SettingLayer parse_config(std::string_view text, const std::string& name,
                          const std::filesystem::path& folder) {
  const toml::table table = formats::parse_toml(text, name);
  SettingLayer layer;
  for (const auto& [key, node] : table) {
    const std::string where = fmt::format("{}, line {}", name, key.source().begin.line);
    const Setting& setting = setting_of_key(key.str(), where);
    const std::string origin = fmt::format("{}: {}", where, key.str());
    layer[std::string(key.str())] = {setting_values(node, setting, origin), origin, true, folder};
  }
  return layer;
}

SettingLayer read_config(const std::filesystem::path& file) {
  return parse_config(formats::read_toml_text(file), file.string(), file.parent_path());
}

}  // namespace cairn::pipeline
