#include "pipeline/study/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "formats/error.h"
#include "formats/toml_text.h"
#include "pipeline/config_table.h"

namespace cairn::pipeline {
namespace {

using formats::Error;
using formats::ErrorKind;

constexpr std::size_t kMostSettings = 10'000;
constexpr const char* kName = "name";

/// Refuses a value that its setting does not allow, with the line where it stands.
void require_allowed(const std::string& key, const GivenValue& given) {
  resolve_campaign({{key, given}}, std::nullopt);
}

const Setting& studied_setting(const toml::key& key, const std::string& where) {
  const Setting& setting = setting_of_key(key.str(), where);
  if (!can_be_studied(setting))
    formats::throw_usage(fmt::format(
        "{}: '{}' tells of {}, not of what is studied; it belongs into an input's campaign", where,
        key.str(), setting.group == "Resources" ? "resources" : "input and output"));
  return setting;
}

class Sweep {
 public:
  explicit Sweep(const std::filesystem::path& file) : file_(file.string()) {}

  std::vector<StudySetting> expand(const SweepTables& tables) {
    if (tables.fixed != nullptr) fixed_ = values_of(*tables.fixed);
    if (tables.swept != nullptr) add_product(*tables.swept);
    for (const toml::table* table : tables.single) add_single(*table);
    if (settings_.empty()) settings_.push_back({"as given", fixed_});
    return std::move(settings_);
  }

 private:
  std::string line_of(const toml::source_region& source) const {
    return fmt::format("{}, line {}", file_, source.begin.line);
  }

  GivenValue given(const toml::node& node, const Setting& setting, const std::string& where) const {
    const std::string origin = fmt::format("{}: {}", where, setting.key);
    GivenValue value{setting_values(node, setting, origin), origin};
    require_allowed(std::string(setting.key), value);
    return value;
  }

  /// Those of a table, but for its `name`.
  SettingLayer values_of(const toml::table& table, std::string_view except = {}) const {
    SettingLayer values;
    for (const auto& [key, node] : table) {
      if (key.str() == except) continue;
      const std::string where = line_of(key.source());
      values[std::string(key.str())] = given(node, studied_setting(key, where), where);
    }
    return values;
  }

  /// The values of each swept key.
  std::map<std::string, std::vector<GivenValue>> axes_of(const toml::table& swept) const {
    std::map<std::string, std::vector<GivenValue>> axes;
    for (const auto& [key, node] : swept) {
      const std::string where = line_of(key.source());
      const Setting& setting = studied_setting(key, where);
      const toml::array* items = node.as_array();
      if (items == nullptr || items->empty())
        throw Error(ErrorKind::kUsage, {.what = fmt::format("{}: {}", where, key.str()),
                                        .found = formats::described(node),
                                        .expected = "an array of the values to build with"});
      if (fixed_.contains(key.str()))
        formats::throw_usage(fmt::format("{}: '{}' is fixed by [settings]", where, key.str()));
      for (const toml::node& item : *items)
        axes[std::string(key.str())].push_back(given(item, setting, line_of(item.source())));
    }
    return axes;
  }

  void add_product(const toml::table& swept) {
    const auto axes = axes_of(swept);
    std::vector<StudySetting> product{{"", fixed_}};
    for (const Setting& setting : build_settings()) {
      const auto axis = axes.find(std::string(setting.key));
      if (axis == axes.end()) continue;
      std::vector<StudySetting> longer;
      for (const StudySetting& before : product)
        for (const GivenValue& value : axis->second) {
          longer.push_back(before);
          longer.back().values[axis->first] = value;
          longer.back().varied.push_back(axis->first);
        }
      if (longer.size() > kMostSettings)
        formats::throw_usage(fmt::format("{}: [sweep] asks for more than {} settings",
                                         line_of(swept.source()), kMostSettings));
      product = std::move(longer);
    }
    if (axes.empty()) return;
    for (StudySetting& setting : product) add(std::move(setting), {}, line_of(swept.source()));
  }

  void add_single(const toml::table& table) {
    const std::string where = line_of(table.source());
    StudySetting setting{"", fixed_};
    for (auto& [key, value] : values_of(table, kName)) {
      setting.values[key] = value;
      setting.varied.push_back(key);
    }
    std::string name;
    if (const toml::node* node = table.get(kName)) {
      const auto plain = plain_name(*node);
      if (!plain)
        throw Error(ErrorKind::kUsage, {.what = where + ": name",
                                        .found = formats::described(*node),
                                        .expected = std::string(kPlainName)});
      name = *plain;
    }
    add(std::move(setting), name, where);
  }

  void add(StudySetting setting, const std::string& name, const std::string& where) {
    setting.label = name.empty() ? label_of(setting) : name;
    for (const StudySetting& other : settings_) {
      if (other.label == setting.label)
        formats::throw_usage(fmt::format("{}: two settings are called '{}'", where, setting.label));
      if (same(other.values, setting.values))
        formats::throw_usage(fmt::format("{}: the settings '{}' and '{}' are the same", where,
                                         other.label, setting.label));
    }
    settings_.push_back(std::move(setting));
  }

  static bool same(const SettingLayer& a, const SettingLayer& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
      return x.first == y.first && x.second.values == y.second.values;
    });
  }

  /// Words speak for themselves, numbers need their key.
  static std::string label_of(const StudySetting& setting) {
    std::string label;
    for (const std::string& key : setting.varied) {
      const std::string value = fmt::format("{}", fmt::join(setting.values.at(key).values, " "));
      const bool is_word = find_setting(key)->kind == SettingKind::kText;
      label += (label.empty() ? "" : ", ") +
               (is_word ? value : key + " " + (value.empty() ? "none" : value));
    }
    return label.empty() ? "as given" : label;
  }

  std::string file_;
  SettingLayer fixed_;
  std::vector<StudySetting> settings_;
};

}  // namespace

std::vector<StudySetting> expand_sweep(const SweepTables& tables,
                                       const std::filesystem::path& file) {
  return Sweep(file).expand(tables);
}

}  // namespace cairn::pipeline
