#include "stages/simulate/effects/beam_divergence.h"

#include <cmath>
#include <numbers>

#include "stages/simulate/effects/light.h"

namespace cairn::stages {
namespace {

/// Where a sub-ray meets a plane across the axis at distance 1.
struct Offset {
  double x, y;
};

std::vector<Offset> offsets(const BeamDivergence& settings) {
  const double half = settings.divergence / 2 * std::numbers::pi / 180;
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Offset> result;
  for (unsigned k = 1; k < settings.rays; ++k) {
    const double outside = 1 - (k + 0.5) / settings.rays;
    const double reach = std::tan(half * std::sqrt(-std::log(outside) / 2));
    result.push_back({reach * std::cos(k * golden_angle), reach * std::sin(k * golden_angle)});
  }
  return result;
}

class BeamDivergenceEffect : public EchoEffect {
 public:
  explicit BeamDivergenceEffect(const BeamDivergence& settings)
      : resolution_(settings.resolution), offsets_(offsets(settings)) {}

  void apply(const Beam& beam, RayEchoes& echoes) const override {
    const std::vector<Echo> around = footprint(beam);
    if (echoes.empty() && !around.empty()) echoes.add(around.front());
    for (Echo& echo : echoes) {
      if (echo.object == nullptr) continue;
      echo.range += mixed(echo, around) - echo.distance;
      echo.direction = beam.direction;
    }
  }

 private:
  std::vector<Echo> footprint(const Beam& beam) const {
    const Vector3& axis = beam.direction;
    const Vector3 across =
        normalised(std::fabs(axis[2]) < 0.7 ? cross(axis, {0, 0, 1}) : cross(axis, {1, 0, 0}));
    const Vector3 other = cross(axis, across);
    std::vector<Echo> around;
    for (const auto& [x, y] : offsets_)
      if (const auto echo = beam.sight.look(beam.ray, normalised(axis + across * x + other * y)))
        around.push_back(*echo);
    return around;
  }

  /// An axis that met nothing is its first sub-ray, and counts a second time like any axis.
  double mixed(const Echo& axis, const std::vector<Echo>& around) const {
    double power = returned_power(axis, 1), sum = power * axis.distance;
    for (const Echo& echo : around) {
      if (std::fabs(echo.distance - axis.distance) > resolution_) continue;
      power += returned_power(echo, 1);
      sum += returned_power(echo, 1) * echo.distance;
    }
    return power > 0 ? sum / power : axis.distance;
  }

  double resolution_;
  std::vector<Offset> offsets_;
};

}  // namespace

EchoEffectPtr make_beam_divergence(const BeamDivergence& settings) {
  return std::make_unique<BeamDivergenceEffect>(settings);
}

}  // namespace cairn::stages
