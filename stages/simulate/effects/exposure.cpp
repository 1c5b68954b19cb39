#include "stages/simulate/effects/exposure.h"

#include <cmath>

#include "stages/simulate/effects/light.h"

namespace cairn::stages {
namespace {

class ExposureEffect : public EchoEffect {
 public:
  explicit ExposureEffect(const std::array<double, 3>& gains) {
    for (std::size_t channel = 0; channel < 3; ++channel)
      for (std::size_t value = 0; value < 256; ++value)
        developed_[channel][value] =
            encoded_light(gains[channel] * linear_light(static_cast<std::uint8_t>(value)));
  }

  void apply(const Beam&, RayEchoes& echoes) const override {
    for (Echo& echo : echoes)
      for (std::size_t channel = 0; channel < 3; ++channel)
        echo.color[channel] = developed_[channel][echo.surface[channel]];
  }

 private:
  std::array<std::array<std::uint8_t, 256>, 3> developed_;
};

}  // namespace

std::array<double, 3> Exposure::gains(const Draws& draws) const {
  // One camera a station: its numbers are those of ray 0.
  const auto [z0, z1] = draws.normal(0, 0);
  const auto [z2, z3] = draws.normal(0, 1);
  const double stops = exposure * z0;
  return {std::exp2(stops + white_balance * z1), std::exp2(stops + white_balance * z2),
          std::exp2(stops + white_balance * z3)};
}

EchoEffectPtr make_exposure(const Exposure& settings, const Draws& draws) {
  return std::make_unique<ExposureEffect>(settings.gains(draws));
}

}  // namespace cairn::stages
