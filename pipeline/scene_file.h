// Scene files: TOML that says what the simulated scanner sees, where it stands and what it writes.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "stages/simulate/scanner.h"

namespace cairn::pipeline {

struct SceneFile {
  std::string name;  ///< of the campaign: letters, digits, '_', '-' and '.'
  stages::Scene scene;
  stages::Effects effects;
  std::string format = "ply";  ///< ply or las
  stages::ScanFrame frame = stages::ScanFrame::kSensor;
};

/// The scene that a text describes; the README lists the keys. `file` stands for it in messages, its stem is the
/// name unless the text gives one, and its folder is where relative paths of meshes start. Throws Error: kUsage,
/// naming file, line, key and what is allowed, for text that is not TOML, an unknown or missing key, a value of a
/// wrong type or one that is impossible; what read_mesh throws for a mesh, and what read_scene does for a base.
SceneFile parse_scene(std::string_view text, const std::filesystem::path& file);

/// The same of a file. Throws kSystem if it cannot be read.
SceneFile read_scene(const std::filesystem::path& file);

}  // namespace cairn::pipeline
