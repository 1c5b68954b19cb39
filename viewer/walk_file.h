// Walks as TOML files:
//
//   frames_per_second = 30     # above 0, at most 1000; this is the default
//   [[camera]]                 # at least one; times increase
//   time = 0.0                 # seconds from the start, at least 0
//   eye = [10, 0, 2]
//   target = [0, 0, 1]
//   up = [0, 0, 1]             # default
//   fov = 50                   # degrees between the upper and the lower edge; default
//
// or, instead of cameras, the short form of a way around a center, as Orbit in walk.h has it:
//
//   [orbit]
//   center = [0, 0, 1]
//   radius = 10
//   seconds = 12
//   height = 2                 # default 0
//   turns = 1                  # default
//   start = -90                # degrees; default
//   fov = 50                   # default
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "viewer/walk.h"

namespace cairn::viewer {

/// The walk that a text describes; `file` stands for it in messages. Throws Error (kUsage), naming file, line and key,
/// what is found and what is expected, for text that is not TOML, an unknown or missing key, a value of a wrong type or
/// one that is impossible.
Walk parse_walk(std::string_view text, const std::filesystem::path& file);

/// The same of a file. Throws as formats::read_toml_text, too.
Walk read_walk(const std::filesystem::path& file);

/// The text that parse_walk reads to an equal walk, keyframe by keyframe and bit by bit.
std::string walk_text(const Walk& walk);

/// The same as a file, which replaces what has its name and appears whole or not at all. Throws kSystem.
void write_walk(const Walk& walk, const std::filesystem::path& file);

}  // namespace cairn::viewer
