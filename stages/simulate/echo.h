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
  std::uint32_t object;  ///< kNoObject: none of the scene's
  std::uint32_t number;  ///< of the ray's echoes, counted from 0 where they arise

  // Measured.
  double range;
  Vector3 direction;
  double intensity;  ///< 0 to 1
  Rgb color;

  static constexpr std::uint32_t kNoObject = ~std::uint32_t{0};
};

/// An echo of something at `distance` that is no object of the scene and faces the scanner.
inline Echo stray_echo(double distance, const Vector3& direction, const Rgb& color) {
  return {.distance = distance,
          .incidence_cosine = 1,
          .normal = direction * -1,
          .surface = color,
          .object = Echo::kNoObject,
          .number = 0,
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
  template <typename Unwanted>
  void remove_if(Unwanted unwanted) {
    all_.erase(std::remove_if(begin(), end(), unwanted), end());
  }
  void replace_by(const Echo& echo) {
    all_.resize(first_, echo);
    add(echo);
  }

 private:
  std::vector<Echo>& all_;
  std::size_t first_;
};

}  // namespace cairn::stages
