// Settings as TOML gives them: what configuration files and studies have in common.
#pragma once

#include <toml++/toml.h>

#include <string>
#include <string_view>
#include <vector>

#include "pipeline/settings.h"

namespace cairn::pipeline {

/// The setting of this key. Throws kUsage, beginning with `where` and naming the nearest key, if there is none or it is
/// a flag only.
const Setting& setting_of_key(std::string_view key, const std::string& where);

/// The values that a node gives for the setting, as GivenValue holds them. Throws kUsage, naming `origin`, for one that
/// has not the setting's type; ranges are checked when settings are resolved.
std::vector<std::string> setting_values(const toml::node& node, const Setting& setting,
                                        const std::string& origin);

}  // namespace cairn::pipeline
