// Scans of a simulated station, in memory.
#pragma once

#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "stages/simulate/scanner.h"

namespace cairn::stages {

struct Scan {
  std::vector<Vector3> points;
  std::vector<std::array<std::int32_t, 3>> steps;
  std::vector<std::array<float, 3>> normals;
  std::vector<std::uint16_t> intensities;
  std::vector<Rgb> colors;
  std::string bytes;  ///< all of these
  std::uint64_t told = 0;
  std::vector<std::uint8_t> return_numbers, return_counts;  ///< if there are several
  EffectCalls effect_calls{};
};

struct ScanSetup {
  unsigned threads = 2;
  ScanFrame frame = ScanFrame::kSensor;
  bool steps = false;
};

template <typename T>
void append(std::vector<T>& to, const std::vector<std::byte>& bytes) {
  const std::size_t before = to.size();
  to.resize(before + bytes.size() / sizeof(T));
  std::memcpy(to.data() + before, bytes.data(), bytes.size());
}

inline Scan scan(const std::vector<SceneObject>& objects, const Station& station,
                 const ScanSetup& setup = {}, const StationEffects& effects = {}) {
  const auto description =
      describe_station(effects.recorded(station), setup.frame, setup.steps, effects.most_echoes());
  Scan result;
  const Context context{.threads = setup.threads, .memory_bytes = std::uint64_t{1} << 30};
  const ScanCounts counts = scan_station(
      context, objects, station, effects, setup.frame, description,
      [&](const formats::PointBlock& block) {
        result.points.insert(result.points.end(), block.world.begin(), block.world.end());
        result.steps.insert(result.steps.end(), block.steps.begin(), block.steps.end());
        append(result.normals, block.columns[0]);
        append(result.intensities, block.columns[1]);
        append(result.colors, block.columns[2]);
        if (block.columns.size() > 3) {
          append(result.return_numbers, block.columns[3]);
          append(result.return_counts, block.columns[4]);
        }
        result.bytes.append(reinterpret_cast<const char*>(block.world.data()),
                            block.world.size() * sizeof(Vector3));
        for (const auto& column : block.columns)
          result.bytes.append(reinterpret_cast<const char*>(column.data()), column.size());
      });
  result.told = counts.points;
  result.effect_calls = counts.effect_calls;
  return result;
}

inline SceneObject object(ShapePtr shape, const Vector3& position, Rgb color = {1, 2, 3}) {
  return {std::move(shape), pose_at(position, {1, 0, 0, 0}), {.first = color}};
}

inline Raster raster(std::uint64_t columns, std::uint64_t rows, double elevation_begin = -60,
                     double elevation_end = 60) {
  Raster result;
  result.columns = columns;
  result.rows = rows;
  result.elevation_begin = elevation_begin;
  result.elevation_end = elevation_end;
  return result;
}

}  // namespace cairn::stages
