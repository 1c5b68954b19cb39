#include "stages/simulate/effects/intensity_falloff.h"

#include <algorithm>
#include <cmath>

#include "stages/simulate/effects/light.h"

namespace cairn::stages {
namespace {

class IntensityFalloffEffect : public EchoEffect {
 public:
  explicit IntensityFalloffEffect(const IntensityFalloff& settings) : settings_(settings) {}

  void apply(const Beam&, RayEchoes& echoes) const override {
    for (Echo& echo : echoes) {
      const double way = 2 * (echo.distance - settings_.reference_range);
      echo.intensity = std::min(1.0, returned_power(echo, settings_.reference_range) *
                                         std::exp(-settings_.attenuation * way));
    }
  }

 private:
  IntensityFalloff settings_;
};

}  // namespace

EchoEffectPtr make_intensity_falloff(const IntensityFalloff& settings) {
  return std::make_unique<IntensityFalloffEffect>(settings);
}

}  // namespace cairn::stages
