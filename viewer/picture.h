// A finished picture, and PNG.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "viewer/camera.h"

namespace cairn::viewer {

struct Picture {
  PictureSize size{0, 0};
  std::vector<std::uint8_t> rgb;  ///< rows from the top, 3 bytes a pixel

  friend bool operator==(const Picture&, const Picture&) = default;
};

/// Writes 8-bit RGB; the file appears whole or not at all. Throws Error (kSystem).
void write_png(const Picture& picture, const std::filesystem::path& path);
/// Reads what write_png writes. Throws Error (kInput, kSystem).
Picture read_png(const std::filesystem::path& path);

}  // namespace cairn::viewer
