#include "stages/simulate/effects/outliers.h"

namespace cairn::stages {
namespace {

/// There is no surface that could have a colour.
constexpr Rgb kGrey{128, 128, 128};

class OutliersEffect : public EchoEffect {
 public:
  OutliersEffect(const Outliers& settings, const Draws& draws)
      : settings_(settings), draws_(draws) {}

  void apply(const Beam& beam, RayEchoes& echoes) const override {
    const auto [chance, place] = draws_.uniform(beam.ray);
    if (chance < settings_.share)
      echoes.replace_by(stray_echo(beam.max_range * place, beam.direction, kGrey));
  }

 private:
  Outliers settings_;
  Draws draws_;
};

}  // namespace

EchoEffectPtr make_outliers(const Outliers& settings, const Draws& draws) {
  return std::make_unique<OutliersEffect>(settings, draws);
}

}  // namespace cairn::stages
