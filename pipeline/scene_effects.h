// The effects that a scene file names.
#pragma once

#include <filesystem>

#include "pipeline/checked_table.h"
#include "stages/simulate/effects/station_effects.h"

namespace cairn::pipeline {

/// What a table [effects] says: a seed, and a table a named effect. Throws kUsage as parse_scene does.
stages::Effects read_effects(const toml::table& effects, const std::filesystem::path& file);

}  // namespace cairn::pipeline
