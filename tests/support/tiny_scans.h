// Small scans, written by hand.
#pragma once

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.h"

namespace cairn::test {

/// An ascii PLY of `count` points on a curve. Returns the path.
inline std::string write_tiny_ply(const std::filesystem::path& path, int count = 100) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(count) +
                     "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  for (int i = 0; i < count; ++i)
    text += std::to_string(i * 0.25) + " " + std::to_string(i * i * 0.125) + " " +
            std::to_string(i % 7) + "\n";
  write_text(path, text);
  return path.string();
}

/// A LAS 1.2 of point format 0 whose `count` points lie on a wavy square, millimetre steps.
inline std::string write_wavy_las(const std::filesystem::path& path, std::uint32_t count) {
  std::string bytes(227, '\0');
  const auto put = [&bytes](std::size_t offset, auto value) {
    std::memcpy(&bytes[offset], &value, sizeof value);
  };
  bytes.replace(0, 4, "LASF");
  put(24, std::uint8_t{1});
  put(25, std::uint8_t{2});
  put(94, std::uint16_t{227});
  put(96, std::uint32_t{227});
  put(105, std::uint16_t{20});
  put(107, count);
  for (std::size_t axis = 0; axis < 3; ++axis) put(131 + 8 * axis, 0.001);
  bytes.resize(227 + std::size_t{20} * count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::size_t record = 227 + std::size_t{20} * i;
    const auto x = static_cast<std::int32_t>(i * 2654435761U >> 12);
    const auto y = static_cast<std::int32_t>(i * 40503U % 1000003U);
    put(record, x);
    put(record + 4, y);
    put(record + 8, (x / 64) * (y / 64) % 4096);
    put(record + 12, static_cast<std::uint16_t>(i));
  }
  write_text(path, bytes);
  return path.string();
}

}  // namespace cairn::test
