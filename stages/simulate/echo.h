// What the scanner measured along a ray.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "stages/simulate/scene.h"

namespace cairn::stages {

/// A surface that sent light back. What is true of it stays as the ray found it, so that no effect's value depends
/// on what others did; what was measured of it begins as the truth. In the station's frame.
struct Echo {
  // True.
  double distance;
  double incidence_cosine;
  Vector3 normal;  ///< of length 1, facing the scanner
  Rgb surface;
  const SceneObject* object;  ///< nullptr: none of the scene's
  std::uint32_t number;       ///< of the ray's echoes, counted from 0 where they arise
  double energy;              ///< share of the beam that met the surface

  // Measured.
  double range;
  Vector3 direction;
  double intensity;  ///< 0 to 1
  Rgb color;
  std::uint8_t return_number = 1, return_count = 1;  ///< among those that are told
};

/// An echo of something at `distance` that is no object of the scene and faces the scanner.
inline Echo stray_echo(double distance, const Vector3& direction, const Rgb& color) {
  return {.distance = distance,
          .incidence_cosine = 1,
          .normal = direction * -1,
          .surface = color,
          .object = nullptr,
          .number = 0,
          .energy = 1,
          .range = distance,
          .direction = direction,
          .intensity = 1,
          .color = color};
}

/// The echoes of one ray, which stand at the end of those of many. Near ones come first.
class RayEchoes {
 public:
  explicit RayEchoes(std::vector<Echo>& all) : all_(all), first_(all.size()) {}

  auto begin() { return all_.begin() + static_cast<std::ptrdiff_t>(first_); }
  auto end() { return all_.end(); }
  bool empty() const { return all_.size() == first_; }
  void add(const Echo& echo) { all_.push_back(echo); }
  void clear() { all_.erase(begin(), end()); }
  template <typename Unwanted>
  void remove_if(Unwanted unwanted) {
    all_.erase(std::remove_if(begin(), end(), unwanted), end());
  }
  void replace_by(const Echo& echo) {
    clear();
    add(echo);
  }

 private:
  std::vector<Echo>& all_;
  std::size_t first_;
};

}  // namespace cairn::stages
