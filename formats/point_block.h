// A block of points on its way from a scan reader to the import stage: columns, in the scan's own
// coordinates.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cairn::formats {

/// How a scan stores its positions.
enum class PositionEncoding : std::uint8_t {
  kSteps,    ///< int32 steps: world = offset + scale * step, per axis (LAS)
  kFloat32,  ///< world coordinates that were float32 in the file
  kFloat64,  ///< world coordinates
};

/// Blocks hold at most this many points.
inline constexpr std::size_t kBlockPoints = 65536;

struct PointBlock {
  std::size_t count = 0;
  /// Records met since the block before that hold no point, such as empty cells of a gridded scan.
  std::uint64_t no_return = 0;
  std::vector<std::array<std::int32_t, 3>>
      steps;  ///< `count` entries if the encoding is kSteps, else empty
  std::vector<std::array<double, 3>>
      world;  ///< `count` entries if it is kFloat32 or kFloat64, else empty
  /// One column an attribute of the scan's schema: count * Attribute::size_bytes() bytes, little-endian.
  std::vector<std::vector<std::byte>> columns;
};

}  // namespace cairn::formats
