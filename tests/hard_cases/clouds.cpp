#include "tests/hard_cases/clouds.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>

namespace cairn::test {
namespace {

template <typename T>
void append(std::string& bytes, T value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof value);
}

void write(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// In [0, 1), the same everywhere: distributions of the standard library are not.
double unit(std::mt19937_64& random) {
  return std::ldexp(static_cast<double>(random() >> 11), -53);
}

}  // namespace

void write_ply(const std::filesystem::path& path, const Cloud& cloud, bool as_float) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(cloud.size()) + "\n";
  for (const char* axis : {"x", "y", "z"})
    bytes += std::string("property ") + (as_float ? "float " : "double ") + axis + "\n";
  if (!cloud.normals.empty())
    for (const char* axis : {"nx", "ny", "nz"})
      bytes += std::string("property float ") + axis + "\n";
  if (!cloud.radii.empty()) bytes += "property float radius\n";
  bytes += "end_header\n";
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for (const double x : cloud.positions[i])
      as_float ? append(bytes, static_cast<float>(x)) : append(bytes, x);
    if (!cloud.normals.empty())
      for (const float n : cloud.normals[i]) append(bytes, n);
    if (!cloud.radii.empty()) append(bytes, cloud.radii[i]);
  }
  write(path, bytes);
}

namespace {

/// What follows the coordinates is of a record's own format.
using AppendRest = std::function<void(std::string& bytes, std::size_t point)>;

void write_las_of_format(const std::filesystem::path& path, std::uint8_t format,
                         std::uint16_t record_bytes, const LasGrid& grid,
                         const std::vector<std::array<std::int32_t, 3>>& steps,
                         const AppendRest& append_rest) {
  constexpr std::size_t kHeaderBytes = 227;
  std::string bytes(kHeaderBytes, '\0');
  const auto put = [&](std::size_t at, auto value) {
    std::memcpy(&bytes[at], &value, sizeof value);
  };
  bytes.replace(0, 4, "LASF");
  put(24, std::uint8_t{1});
  put(25, std::uint8_t{2});
  put(94, std::uint16_t{kHeaderBytes});
  put(96, std::uint32_t{kHeaderBytes});
  put(104, format);
  put(105, record_bytes);
  put(107, static_cast<std::uint32_t>(steps.size()));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    put(131 + 8 * axis, grid.scale[axis]);
    put(155 + 8 * axis, grid.offset[axis]);
  }
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const std::size_t end = bytes.size() + record_bytes;
    for (const std::int32_t step : steps[i]) append(bytes, step);
    append_rest(bytes, i);
    bytes.resize(end);
  }
  write(path, bytes);
}

}  // namespace

void write_las(const std::filesystem::path& path, const LasGrid& grid,
               const std::vector<std::array<std::int32_t, 3>>& steps) {
  write_las_of_format(path, 0, 20, grid, steps, [](std::string& bytes, std::size_t i) {
    append(bytes, static_cast<std::uint16_t>(i));
  });
}

void write_colored_las(const std::filesystem::path& path, const LasGrid& grid,
                       const std::vector<std::array<std::int32_t, 3>>& steps) {
  write_las_of_format(path, 3, 34, grid, steps, [](std::string& bytes, std::size_t i) {
    bytes.append(8, '\0');  // intensity to source number
    append(bytes, i % 3 == 0 ? std::numeric_limits<double>::quiet_NaN()
                             : 1e9 + 1e-6 * static_cast<double>(i));
    for (std::size_t c = 0; c < 3; ++c)
      append(bytes, static_cast<std::uint16_t>((i * (c + 1)) % 256));
  });
}

Cloud random_box(std::size_t count, const Position& corner, const Position& size, unsigned seed) {
  std::mt19937_64 random(seed);
  Cloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    Position p;
    for (std::size_t axis = 0; axis < 3; ++axis) p[axis] = corner[axis] + size[axis] * unit(random);
    cloud.positions.push_back(p);
  }
  return cloud;
}

Cloud identical(std::size_t count, const Position& at) {
  return {.positions = std::vector<Position>(count, at), .normals = {}, .radii = {}};
}

Cloud line(std::size_t count, const Position& from, const Position& to) {
  Cloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(count);
    Position p;
    for (std::size_t axis = 0; axis < 3; ++axis) p[axis] = from[axis] + t * (to[axis] - from[axis]);
    cloud.positions.push_back(p);
  }
  return cloud;
}

Cloud two_sheets(std::size_t count_each, double size, double gap) {
  Cloud cloud;
  for (const float up : {-1.0F, 1.0F}) {
    const Cloud sheet = random_box(count_each, {0, 0, up > 0 ? gap : 0}, {size, size, 0}, 7);
    cloud.positions.insert(cloud.positions.end(), sheet.positions.begin(), sheet.positions.end());
    cloud.normals.insert(cloud.normals.end(), count_each, {0, 0, up});
  }
  return cloud;
}

Cloud helix(std::size_t count, double radius, double height, double turns) {
  Cloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / static_cast<double>(count);
    const double angle = 2 * std::numbers::pi * turns * t;
    cloud.positions.push_back({radius * std::cos(angle), radius * std::sin(angle), height * t});
  }
  return cloud;
}

Cloud two_densities(std::size_t count) {
  return joined(random_box(count / 2, {0, 0, 0}, {1, 1, 1}, 3),
                random_box(count - count / 2, {0.6, 0.3, 0.2}, {0.01, 0.01, 0.01}, 4));
}

Cloud tunnel(std::size_t count) {
  std::mt19937_64 random(5);
  Cloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * unit(random);
    cloud.positions.push_back({2000 * unit(random), 1.5 * std::cos(angle), 1.5 * std::sin(angle)});
    cloud.normals.push_back(
        {0, static_cast<float>(-std::cos(angle)), static_cast<float>(-std::sin(angle))});
  }
  return cloud;
}

Cloud joined(Cloud first, const Cloud& second) {
  first.positions.insert(first.positions.end(), second.positions.begin(), second.positions.end());
  first.normals.insert(first.normals.end(), second.normals.begin(), second.normals.end());
  first.radii.insert(first.radii.end(), second.radii.begin(), second.radii.end());
  return first;
}

Cloud moved(Cloud cloud, const Position& by) {
  for (Position& p : cloud.positions)
    for (std::size_t axis = 0; axis < 3; ++axis) p[axis] += by[axis];
  return cloud;
}

Cloud scaled(Cloud cloud, double factor) {
  for (Position& p : cloud.positions)
    for (double& x : p) x *= factor;
  return cloud;
}

std::vector<std::array<std::int32_t, 3>> random_steps(std::size_t count, std::int32_t least,
                                                      std::int32_t greatest, unsigned seed) {
  std::mt19937_64 random(seed);
  const std::uint64_t range = static_cast<std::uint64_t>(std::int64_t{greatest} - least) + 1;
  std::vector<std::array<std::int32_t, 3>> steps{{least, least, least},
                                                 {greatest, greatest, greatest}};
  while (steps.size() < count) {
    std::array<std::int32_t, 3> p;
    for (std::int32_t& x : p)
      x = static_cast<std::int32_t>(least + static_cast<std::int64_t>(random() % range));
    steps.push_back(p);
  }
  return steps;
}

}  // namespace cairn::test
