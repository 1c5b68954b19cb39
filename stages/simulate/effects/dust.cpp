#include "stages/simulate/effects/dust.h"

#include <cmath>

namespace cairn::stages {
namespace {

class DustEffect : public EchoEffect {
 public:
  DustEffect(const Dust& settings, const Draws& draws) : settings_(settings), draws_(draws) {}

  void apply(const Beam& beam, RayEchoes& echoes) const override {
    const double free_way = -settings_.mean_free_path * std::log(draws_.uniform(beam.ray)[0]);
    const double way = echoes.empty() ? beam.max_range : echoes.begin()->distance;
    if (free_way < way) echoes.replace_by(stray_echo(free_way, beam.direction, settings_.color));
  }

 private:
  Dust settings_;
  Draws draws_;
};

}  // namespace

EchoEffectPtr make_dust(const Dust& settings, const Draws& draws) {
  return std::make_unique<DustEffect>(settings, draws);
}

}  // namespace cairn::stages
