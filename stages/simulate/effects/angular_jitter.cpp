#include "stages/simulate/effects/angular_jitter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace cairn::stages {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

class AngularJitterEffect : public EchoEffect {
 public:
  AngularJitterEffect(const AngularJitter& settings, const Draws& draws)
      : settings_(settings), draws_(draws) {}

  void apply(const Beam& beam, RayEchoes& echoes) const override {
    if (echoes.empty()) return;
    const auto& [x, y, z] = beam.direction;
    const auto [first, second] = draws_.normal(beam.ray);
    const double azimuth = std::atan2(y, x) + settings_.azimuth * kDegree * first;
    const double elevation =
        std::asin(std::clamp(z, -1.0, 1.0)) + settings_.elevation * kDegree * second;
    const double level = std::cos(elevation);
    for (Echo& echo : echoes)
      echo.direction = {level * std::cos(azimuth), level * std::sin(azimuth), std::sin(elevation)};
  }

 private:
  AngularJitter settings_;
  Draws draws_;
};

}  // namespace

EchoEffectPtr make_angular_jitter(const AngularJitter& settings, const Draws& draws) {
  return std::make_unique<AngularJitterEffect>(settings, draws);
}

}  // namespace cairn::stages
