// What measure found of the geometry of levels, for people and for programs.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "stages/measure/measure.h"

namespace cairn::pipeline {

/// Tables of what was measured, a level a line, those that have no line left out.
std::string geometry_text(const stages::ErrorReport& report);

/// {"surface": {...} or null, "spacing": ..., "truth": ...}; intervals are [low, high], or null where all points were
/// measured; a factor that does not exist is null.
nlohmann::ordered_json geometry_json(const stages::GeometryError& geometry);

}  // namespace cairn::pipeline
