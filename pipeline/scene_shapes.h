// What a table [[object]] of a scene file says of the object's shape and colours.
#pragma once

#include <filesystem>

#include "pipeline/checked_table.h"
#include "stages/simulate/scene.h"

namespace cairn::pipeline {

/// Asks for `type` and the keys of that type. Relative paths of meshes start from `folder`. Throws as parse_scene.
stages::ShapePtr read_shape(CheckedTable& table, const std::filesystem::path& folder);

/// Asks for color, color2, pattern and pattern_size.
stages::Paint read_paint(CheckedTable& table);

/// A reader of nodes like those of checked_table.h, and what it allows.
std::optional<stages::Rgb> any_color(const toml::node& node);
inline constexpr std::string_view kColor = "three whole numbers from 0 to 255: [red, green, blue]";

}  // namespace cairn::pipeline
