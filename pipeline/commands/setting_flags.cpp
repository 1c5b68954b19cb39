#include "pipeline/commands/setting_flags.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "pipeline/manual/manual.h"

namespace cairn::pipeline {
namespace {

CLI::Option* add(CLI::App& parser, const Setting& setting, const std::string& help) {
  constexpr int kAny = CLI::detail::expected_max_vector_size;
  if (setting.key == "scans")
    return parser.add_option("scans", help)->expected(0, kAny)->allow_extra_args();
  if (setting.key == "output") return parser.add_option("-o," + setting.flag(), help);
  if (setting.kind == SettingKind::kSwitch)
    return parser.add_flag(setting.flag(), help)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  CLI::Option* option = parser.add_option(setting.flag(), help);
  // One value for each time that the flag is given, or it would take the scans behind it.
  if (setting.kind == SettingKind::kTexts) option->expected(1, kAny)->allow_extra_args(false);
  return option;
}

/// Lets the parser know the words that a setting allows, for those that ask it: completions. Refusing others is left to
/// the setting, which can tell where they were given.
void name_choices(CLI::Option& option, const Setting& setting) {
  const std::vector<std::string> words = words_of_choice(setting.allowed);
  if (setting.kind == SettingKind::kSwitch || words.empty()) return;
  option.check(CLI::Validator([](const std::string&) { return std::string(); },
                              fmt::format("{{{}}}", fmt::join(words, ","))));
}

std::string help_of(const Setting& setting) {
  std::string help(setting.help);
  if (setting.kind != SettingKind::kSwitch) help += fmt::format(" ({})", setting.allowed);
  if (!setting.fallback.empty() && setting.kind != SettingKind::kSwitch)
    help += fmt::format(" [{}]", setting.fallback);
  return help;
}

}  // namespace

Flag declare_flag(CLI::App& parser, const Setting& setting) {
  CLI::Option* option = add(parser, setting, help_of(setting));
  if (setting.kind != SettingKind::kSwitch) option->option_text(std::string(setting.value));
  option->group(std::string(setting.group));
  name_choices(*option, setting);
  return {&setting, option};
}

void add_progress_flag(CLI::App& parser, std::string& mode) {
  const Setting& setting = *find_setting("progress");
  parser.add_option("--progress", mode, help_of(setting))
      ->option_text(std::string(setting.value))
      ->check(CLI::IsMember(
          std::vector<std::string>(kProgressModeNames.begin(), kProgressModeNames.end())));
}

CLI::Option* add_threads_flag(CLI::App& parser, unsigned& threads, const std::string& whose) {
  return parser.add_option("--threads", threads, whose + "workers [one a processor]")
      ->option_text("COUNT")
      ->check(CLI::Range(1U, 1024U));
}

SettingLayer given_flags(const std::vector<Flag>& flags) {
  SettingLayer layer;
  for (const auto& [setting, option] : flags)
    if (option->count() > 0)
      layer[std::string(setting->key)] = {option->results(),
                                          setting->key == "scans" ? "SCANS" : setting->flag()};
  return layer;
}

}  // namespace cairn::pipeline
