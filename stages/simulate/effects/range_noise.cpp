#include "stages/simulate/effects/range_noise.h"

#include <algorithm>
#include <cmath>

namespace cairn::stages {
namespace {

constexpr double kLeastCosine = 0.1;

class RangeNoiseEffect : public EchoEffect {
 public:
  RangeNoiseEffect(const RangeNoise& settings, const Draws& draws)
      : settings_(settings), draws_(draws) {}

  void apply(const Beam& beam, RayEchoes& echoes) const override {
    for (Echo& echo : echoes)
      echo.range += settings_.sigma(echo.distance, echo.incidence_cosine) *
                    draws_.normal(beam.ray, echo.number)[0];
  }

 private:
  RangeNoise settings_;
  Draws draws_;
};

}  // namespace

double RangeNoise::sigma(double distance, double incidence_cosine) const {
  return std::hypot(base, per_length * distance) / std::max(incidence_cosine, kLeastCosine);
}

EchoEffectPtr make_range_noise(const RangeNoise& settings, const Draws& draws) {
  return std::make_unique<RangeNoiseEffect>(settings, draws);
}

}  // namespace cairn::stages
