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

}  // namespace cairn::pipeline
