// Configuration files: TOML whose keys are the settings of settings.h.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "pipeline/settings.h"

namespace cairn::pipeline {

/// The values that a configuration text gives. `name` stands for it in messages; relative paths become
/// relative to `folder`. Throws Error (kUsage) for text that is not TOML, for an unknown key and for a
/// value of a wrong type, naming line, key and what is allowed. Ranges are checked by resolve_settings.
SettingLayer parse_config(std::string_view text, const std::string& name,
                          const std::filesystem::path& folder);

/// The same of a file. Throws kSystem if it cannot be read.
SettingLayer read_config(const std::filesystem::path& file);

}  // namespace cairn::pipeline
