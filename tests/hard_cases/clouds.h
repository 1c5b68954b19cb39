// Point clouds that are hard on a converter, and the two files that they are handed over in.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace cairn::test {

using Position = std::array<double, 3>;

/// Columns are of equal length or empty.
struct Cloud {
  std::vector<Position> positions;
  std::vector<std::array<float, 3>> normals;
  std::vector<float> radii;

  std::size_t size() const { return positions.size(); }
};

/// A binary PLY with positions as double, or as float, which may lose some of them, and all columns that there are.
void write_ply(const std::filesystem::path& path, const Cloud& cloud, bool as_float = false);

/// LAS 1.2, point format 0: world = offset + scale * step on each axis.
struct LasGrid {
  Position scale{0.001, 0.001, 0.001};
  Position offset{0, 0, 0};
};
void write_las(const std::filesystem::path& path, const LasGrid& grid,
               const std::vector<std::array<std::int32_t, 3>>& steps);
/// The same in point format 3, with GPS times of which every third is no number, and colours of 8 bits in fields of 16.
void write_colored_las(const std::filesystem::path& path, const LasGrid& grid,
                       const std::vector<std::array<std::int32_t, 3>>& steps);

/// Pseudo-random points; the same on every machine.
Cloud random_box(std::size_t count, const Position& corner, const Position& size, unsigned seed);
Cloud identical(std::size_t count, const Position& at);
Cloud line(std::size_t count, const Position& from, const Position& to);
/// Two squares of this size, `gap` apart along z, whose normals point away from each other.
Cloud two_sheets(std::size_t count_each, double size, double gap);
Cloud helix(std::size_t count, double radius, double height, double turns);
/// Half of the points in a cube of edge 1, half in one of edge 0.01 in it: a ratio of densities of 10^6.
Cloud two_densities(std::size_t count);
/// Along x, 2000 long, 3 wide, with normals inwards.
Cloud tunnel(std::size_t count);
Cloud joined(Cloud first, const Cloud& second);
/// Each position moved.
Cloud moved(Cloud cloud, const Position& by);
Cloud scaled(Cloud cloud, double factor);

/// Random steps within the range on each axis, and those of the corners.
std::vector<std::array<std::int32_t, 3>> random_steps(std::size_t count, std::int32_t least,
                                                      std::int32_t greatest, unsigned seed);

}  // namespace cairn::test
