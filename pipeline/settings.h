// Every setting of a build in one table: configuration keys, flags, their help, what they accept and the
// table in the README all follow from it.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/build_options.h"
#include "pipeline/progress.h"

namespace cairn::pipeline {

/// All that a configuration file and a command line decide.
struct BuildSettings {
  BuildOptions options;
  ProgressMode progress = ProgressMode::kAuto;
};

enum class SettingKind {
  kSwitch,         ///< TOML boolean; a flag without a value
  kInteger,        ///< TOML integer
  kIntegerOrAuto,  ///< TOML integer, or the string "auto"
  kNumber,         ///< TOML integer or float
  kSize,           ///< TOML integer (bytes) or string ("4GiB", "50%")
  kText,           ///< TOML string
  kTexts,          ///< TOML array of strings, or one; a flag that may be repeated
  kPath,           ///< TOML string; relative to the configuration file's folder
  kPaths,  ///< TOML array of strings, or one; relative as above; "*.las" stands for all such files
};

struct Setting {
  std::string_view key;  ///< as in a configuration file; the flag has '-' for '_'
  SettingKind kind;
  std::string_view group;     ///< heading in the help
  std::string_view value;     ///< placeholder in the help
  std::string_view allowed;   ///< completes "expected ..."
  std::string_view fallback;  ///< the default, for people; empty if there is none
  std::string_view help;      ///< one line
  /// Takes values that have the kind's form; false if they are none that this setting allows.
  bool (*apply)(BuildSettings& settings, const std::vector<std::string>& values);
  bool flag_only = false;  ///< no key of configuration files
  bool in_folder =
      false;  ///< a path in a configuration file starts from `folder`, if that is given

  std::string flag() const;  ///< "--node-points"
};

/// In the order in which they are told to people.
std::span<const Setting> build_settings();
const Setting* find_setting(std::string_view key);

/// Values that one source gives, by key.
struct GivenValue {
  std::vector<std::string> values;
  std::string
      origin;  ///< where it was given, for messages: "site.toml, line 3: fanout" or "--fanout"
  bool in_file = false;             ///< by a configuration file
  std::filesystem::path base = {};  ///< that file's folder, from which relative paths start
};
using SettingLayer = std::map<std::string, GivenValue, std::less<>>;

/// What `flags` say over what the configuration file says over what the preset named by either says over
/// the defaults. Throws Error: kUsage for a value that is not allowed, kSystem for a file that cannot be
/// read.
BuildSettings resolve_settings(const SettingLayer& flags,
                               const std::optional<std::filesystem::path>& config);

/// The scans that they say, and how to open them; nothing else of them is checked to fit together.
CampaignOptions resolve_campaign(const SettingLayer& flags,
                                 const std::optional<std::filesystem::path>& config);

/// The rows of the README's table of settings.
std::string settings_markdown();

}  // namespace cairn::pipeline
