// What measure found, for people and for programs.
#pragma once

#include <filesystem>
#include <string>

#include "pipeline/picture_measure.h"
#include "stages/measure/measure.h"

namespace cairn::pipeline {

/// Tables of distances, attributes and geometry, a level a line.
std::string measure_text(const stages::ErrorReport& report, const std::filesystem::path& folder);

/// {"held": ..., "leaf_points": ..., "levels": [{"level": ..., "rms": ..., "attributes": [...], "geometry": {...},
/// ...}], "leaves": {...}}. With pictures, what pictures_json tells of them stands under "pictures".
std::string measure_json(const stages::ErrorReport& report,
                         const PictureReport* pictures = nullptr);

/// Throws Error (kInvariant) where a point is farther off than a bound allows.
void require_held(const stages::ErrorReport& report);

}  // namespace cairn::pipeline
