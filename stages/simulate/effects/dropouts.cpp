#include "stages/simulate/effects/dropouts.h"

#include <cmath>

#include "stages/simulate/effects/light.h"

namespace cairn::stages {
namespace {

class DropoutsEffect : public EchoEffect {
 public:
  DropoutsEffect(const Dropouts& settings, const Draws& draws)
      : settings_(settings), draws_(draws) {}

  void apply(const Beam& beam, RayEchoes& echoes) const override {
    echoes.remove_if([&](const Echo& echo) {
      const double mean = settings_.photons * returned_power(echo, settings_.reference_range);
      return draws_.uniform(beam.ray, echo.number)[0] < std::exp(-mean);
    });
  }

 private:
  Dropouts settings_;
  Draws draws_;
};

}  // namespace

EchoEffectPtr make_dropouts(const Dropouts& settings, const Draws& draws) {
  return std::make_unique<DropoutsEffect>(settings, draws);
}

}  // namespace cairn::stages
