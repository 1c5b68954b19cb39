// What measure found, for people and for programs.
#pragma once

#include <filesystem>
#include <string>

#include "stages/measure/measure.h"

namespace cairn::pipeline {

/// Tables of distances, attributes and geometry, a level a line.
std::string measure_text(const stages::ErrorReport& report, const std::filesystem::path& folder);

/// {"held": ..., "leaf_points": ..., "levels": [{"level": ..., "rms": ..., "attributes": [...], "geometry": {...},
/// ...}], "leaves": {...}}
std::string measure_json(const stages::ErrorReport& report);

}  // namespace cairn::pipeline
