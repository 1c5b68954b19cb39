// From the points of a column to lanes of small unsigned numbers, and back: the part of the filters that
// knows what the values mean. A lane is one component, or one digit of it, of successive points; points
// lie along a space-filling curve, so successive values differ little.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/dataset/column.h"

namespace cairn::formats {

/// Lanes are handled in blocks of this many points.
inline constexpr std::size_t kLaneBlock = 64;

/// How a column becomes lanes. The flags are on disk. In the order of application:
struct LanePlan {
  enum Flag : std::uint8_t {
    kFactor = 1,  ///< values are divided by `factor`: 8-bit data in 16-bit fields (x 257 or x 256)
    kGreenDifference = 2,  ///< three components r, g, b become r - g, g, b - g
    kCubeDigits = 4,       ///< one component: a code of normal_map becomes its face, row and column
    kAbsolute = 8,         ///< values as they are; without it, differences to the point before
    kMonotone = 16,        ///< differences are not negative; without it (and kAbsolute), zigzag
  };
  static constexpr std::uint8_t kAllFlags = 31;

  std::uint8_t flags = 0;
  std::uint64_t factor = 1;

  bool has(Flag flag) const { return (flags & flag) != 0; }
  std::size_t lanes(std::uint32_t components) const { return has(kCubeDigits) ? 3 : components; }
};

/// Whether a plan, read from a file, can be applied to columns of this shape.
bool plan_fits(const LanePlan& plan, const ColumnShape& shape);

/// The greatest common divisor of the scalars of a column of sizeof(U) bytes each; 1 if all are zero.
template <std::unsigned_integral U>
U common_factor(std::span<const std::byte> column);

/// Whether no component ever decreases from a point to the next, compared as unsigned numbers.
template <std::unsigned_integral U>
bool is_monotone(std::span<const std::byte> column, std::uint32_t components);

/// Splits successive blocks of one column. All arithmetic is modulo 2^bits, so every bit pattern comes back.
template <std::unsigned_integral U>
class LaneSplitter {
 public:
  /// Requires plan_fits.
  LaneSplitter(const ColumnShape& shape, const LanePlan& plan);

  std::size_t lanes() const { return lanes_; }
  /// Splits the next n <= kLaneBlock points, which start at `points`. Lane l lies at out[l * kLaneBlock];
  /// out.size() == lanes() * kLaneBlock.
  void split(const std::byte* points, std::size_t n, std::span<U> out);

 private:
  static void split_block(LaneSplitter& splitter, const std::byte* points, std::size_t n,
                          std::span<U> out) {
    splitter.split_here(points, n, out);
  }
  void split_here(const std::byte* points, std::size_t n, std::span<U> out);

  std::uint32_t components_;
  LanePlan plan_;
  std::size_t lanes_;
  std::vector<U> previous_;  ///< the last value of each lane
};

/// The reverse, for the same sequence of blocks.
template <std::unsigned_integral U>
class LaneJoiner {
 public:
  /// Requires plan_fits.
  LaneJoiner(const ColumnShape& shape, const LanePlan& plan);

  std::size_t lanes() const { return lanes_; }
  /// Writes n points to `points`; uses up the content of `block`.
  void join(std::span<U> block, std::size_t n, std::byte* points);

 private:
  static void join_block(LaneJoiner& joiner, std::span<U> block, std::size_t n, std::byte* points) {
    joiner.join_here(block, n, points);
  }
  void join_here(std::span<U> block, std::size_t n, std::byte* points);

  std::uint32_t components_;
  LanePlan plan_;
  std::size_t lanes_;
  std::vector<U> previous_;
};

}  // namespace cairn::formats
