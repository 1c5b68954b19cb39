#include "stages/simulate/effects/foliage.h"

#include <algorithm>
#include <cmath>

namespace cairn::stages {
namespace {

constexpr double kProjection = 0.5;
/// How far behind a surface the next one is looked for, or it would be found again.
constexpr double kBehind = 1e-6;

/// One beam on its way through foliage.
class Passage {
 public:
  Passage(const Foliage& settings, const Draws& draws, const Beam& beam, RayEchoes& echoes)
      : settings_(settings), draws_(draws), beam_(beam), echoes_(echoes) {}

  void go(const Echo& first) {
    std::optional<Echo> next = first;
    for (; next && !spent(); next = beam_.sight.look(beam_.ray, beam_.direction, at_ + kBehind)) {
      meet_leaves(next->distance);
      if (spent()) return;
      if (!is_foliage(*next)) return add(*next, 1);
      cross(*next->object);
    }
    meet_leaves(beam_.max_range);
  }

  static bool is_foliage(const Echo& echo) { return echo.object->leaf_area_density > 0; }

 private:
  bool spent() const { return returns_ >= settings_.returns || light_ <= 0; }

  /// The leaves up to the distance `end`, in the objects that the beam is in.
  void meet_leaves(double end) {
    double density = 0;
    for (const SceneObject* object : inside_) density += object->leaf_area_density;
    while (!spent() && density > 0) {
      at_ += -std::log(draws_.uniform(beam_.ray, draw_++)[0]) / (kProjection * density);
      if (at_ >= end) break;
      add(stray_echo(at_, beam_.direction, inside_.front()->paint.first), settings_.blocked);
    }
    at_ = end;
  }

  void cross(const SceneObject& object) {
    const auto entered = std::find(inside_.begin(), inside_.end(), &object);
    if (entered == inside_.end())
      inside_.push_back(&object);
    else
      inside_.erase(entered);
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
  RayEchoes& echoes_;
  std::vector<const SceneObject*> inside_;
  double at_ = 0, light_ = 1;
  std::uint32_t returns_ = 0, draw_ = 0;
};

class FoliageEffect : public EchoEffect {
 public:
  FoliageEffect(const Foliage& settings, const Draws& draws) : settings_(settings), draws_(draws) {}

  std::uint64_t most_echoes() const override { return settings_.returns; }

  void apply(const Beam& beam, RayEchoes& echoes) const override {
    if (echoes.empty() || !Passage::is_foliage(*echoes.begin())) return;
    const Echo first = *echoes.begin();
    echoes.clear();
    Passage(settings_, draws_, beam, echoes).go(first);
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
