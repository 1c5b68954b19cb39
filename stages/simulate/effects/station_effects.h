// The effects that a scene names, as they act at one of its stations.
#pragma once

#include <optional>

#include "stages/simulate/effects/effect.h"
#include "stages/simulate/effects/moving_objects.h"
#include "stages/simulate/effects/registration_error.h"

namespace cairn::stages {

/// What a scene names; nothing makes an ideal scanner.
struct Effects {
  std::uint64_t seed = 0;
  std::optional<RegistrationError> registration_error;
  std::optional<MovingObjects> moving_objects;
  std::vector<ChosenEffect> of_echoes;  ///< of different kinds, in any order
};

class StationEffects {
 public:
  StationEffects() = default;  ///< none
  /// `station` is the station's number in the scene.
  StationEffects(const Effects& effects, std::size_t station);

  /// The station as the survey tells it. Rays are cast from the true one.
  Station recorded(const Station& station) const;

  /// Whether beams pass through objects with a leaf area density.
  bool passes_foliage() const;
  bool moves_objects() const { return moving_objects_.has_value(); }
  /// When the given share of the station has been scanned, counted from the begin of the first station. Requires
  /// that it moves objects.
  double time_of(double share) const { return moving_objects_->scan_time * (station_ + share); }

  bool change_echoes() const { return !of_echoes_.empty(); }
  /// How many echoes a beam has at most.
  std::uint64_t most_echoes() const;
  /// Applies the effects of echoes to those of one beam, and counts. Any thread, each with its own `calls`.
  void apply(const Beam& beam, RayEchoes& echoes, EffectCalls& calls) const;

  /// How often those effects were called that a scan of so many rays calls elsewhere.
  EffectCalls other_calls(std::uint64_t rays) const;

 private:
  Draws draws(EffectKind kind) const;
  static void drop_and_number(const Beam& beam, RayEchoes& echoes);

  struct Made {
    EffectKind kind;
    EchoEffectPtr effect;
  };
  std::uint64_t seed_ = 0;
  std::uint32_t station_ = 0;
  std::optional<RegistrationError> registration_error_;
  std::optional<MovingObjects> moving_objects_;
  std::vector<Made> of_echoes_;  ///< by kind
};

}  // namespace cairn::stages
