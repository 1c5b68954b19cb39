#include "stages/simulate/effects/foliage.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

namespace cairn::stages {
namespace {

constexpr double kProjection = 0.5;

/// One beam on its way through foliage.
class Passage {
 public:
  Passage(const Foliage& settings, const Draws& draws, const Beam& beam,
          std::span<const Crossing> crossings, RayEchoes& echoes)
      : settings_(settings), draws_(draws), beam_(beam), crossings_(crossings), echoes_(echoes) {}

  void go(const std::optional<Echo>& solid) {
    const double end = solid ? solid->distance : beam_.max_range;
    while (!spent() && reach_leaf(end))
      add(stray_echo(at_, beam_.direction, leaf_color_), settings_.blocked);
    if (solid && !spent()) add(*solid, 1);
  }

 private:
  bool spent() const { return returns_ >= settings_.returns || light_ <= 0; }

  /// Goes on to the next leaf, or to the distance `end`. The area of leaves on the way, for each unit of the beam's cross
  /// section, is exponential.
  bool reach_leaf(double end) {
    double area = -std::log(draws_.uniform(beam_.ray, draw_++)[0]) / kProjection;
    while (at_ < end) {
      double density = 0, next = end;
      for (const Crossing& crossing : crossings_) {
        if (at_ < crossing.begin) {
          next = std::min(next, crossing.begin);
        } else if (at_ < crossing.end) {
          if (density == 0) leaf_color_ = crossing.object->paint.first;
          density += crossing.object->leaf_area_density;
          next = std::min(next, crossing.end);
        }
      }
      if (area < density * (next - at_)) {
        at_ += area / density;
        return true;
      }
      area -= density * (next - at_);
      at_ = next;
    }
    return false;
  }

  void add(Echo echo, double share) {
    echo.number = returns_++;
    echo.energy = light_ * share;
    echo.intensity *= echo.energy;
    light_ -= echo.energy;
    echoes_.add(echo);
  }

  const Foliage& settings_;
  const Draws& draws_;
  const Beam& beam_;
  std::span<const Crossing> crossings_;
  RayEchoes& echoes_;
  Rgb leaf_color_{};  ///< of the first object that the beam is in
  double at_ = 0, light_ = 1;
  std::uint32_t returns_ = 0, draw_ = 0;
};

class FoliageEffect : public EchoEffect {
 public:
  FoliageEffect(const Foliage& settings, const Draws& draws) : settings_(settings), draws_(draws) {}

  std::uint64_t most_echoes() const override { return settings_.returns; }

  void apply(const Beam& beam, RayEchoes& echoes) const override {
    const std::vector<Crossing> crossings = beam.sight.foliage(beam.direction);
    if (crossings.empty()) return;
    const auto solid = echoes.empty() ? std::nullopt : std::optional(*echoes.begin());
    echoes.clear();
    Passage(settings_, draws_, beam, crossings, echoes).go(solid);
  }

 private:
  Foliage settings_;
  Draws draws_;
};

}  // namespace

EchoEffectPtr make_foliage(const Foliage& settings, const Draws& draws) {
  return std::make_unique<FoliageEffect>(settings, draws);
}

}  // namespace cairn::stages
