// What CMake puts into the program: its version and the presets of configs/, so that the program works
// wherever it is copied to.
#pragma once

#include <span>
#include <string_view>

namespace cairn::pipeline {

std::string_view program_version();

struct Preset {
  std::string_view name;  ///< as for --preset; configs/NAME.toml
  std::string_view text;  ///< the file
};

/// In alphabetical order.
std::span<const Preset> presets();

}  // namespace cairn::pipeline
