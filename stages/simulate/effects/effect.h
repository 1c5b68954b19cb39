// Effects: what makes the simulated scanner less than ideal. Each is one file that tells its formula and where it
// comes from. Effects change echoes, in the order of EffectKind; one that a scene does not name is not made.
//
// Two are no EchoEffect, as they act elsewhere: registration_error, on the pose that is told, and moving_objects, on
// what a ray meets.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "stages/simulate/echo.h"
#include "stages/simulate/effects/random.h"
#include "stages/simulate/ray_caster.h"

namespace cairn::stages {

/// In the order in which they act; an effect's number is part of the key of its random numbers.
enum class EffectKind : std::uint32_t {
  kRegistrationError,
  kMovingObjects,
  kFoliage,
  kBeamDivergence,
  kDust,
  kDropouts,
  kOutliers,
  kRangeNoise,
  kAngularJitter,
  kIntensityFalloff,
  kExposure,
};
/// As scenes call them.
inline constexpr auto kEffectNames = std::to_array<std::string_view>(
    {"registration_error", "moving_objects", "foliage", "beam_divergence", "dust", "dropouts",
     "outliers", "range_noise", "angular_jitter", "intensity_falloff", "exposure"});
inline constexpr std::size_t kEffects = kEffectNames.size();
static_assert(static_cast<std::size_t>(EffectKind::kExposure) == kEffects - 1);

/// How often each effect was called, by kind.
using EffectCalls = std::array<std::uint64_t, kEffects>;

/// What the scene holds in a direction of length 1 in the station's frame, for effects that look where the ray itself
/// does not. Any thread.
class Sight {
 public:
  virtual ~Sight() = default;
  /// The ideal echo of the nearest surface, at the time of the ray number `ray`: of a solid one, if beams pass through
  /// foliage.
  virtual std::optional<Echo> look(std::uint64_t ray, const Vector3& direction) const = 0;
  /// The foliage that a beam passes through, also behind solid surfaces, in the order of the scene's objects.
  virtual std::vector<Crossing> foliage(const Vector3& direction) const = 0;
};

struct Beam {
  std::uint64_t ray;  ///< in the raster's order
  Vector3 direction;  ///< of the raster, in the station's frame
  double max_range;
  const Sight& sight;
};

/// An effect at one station. Any thread.
class EchoEffect {
 public:
  virtual ~EchoEffect() = default;
  /// How many echoes it leaves a beam that had one, at most.
  virtual std::uint64_t most_echoes() const { return 1; }
  /// `echoes` are those of the beam, none if it met nothing.
  virtual void apply(const Beam& beam, RayEchoes& echoes) const = 0;
};
using EchoEffectPtr = std::unique_ptr<const EchoEffect>;

/// An effect that a scene names, before it is made for a station.
struct ChosenEffect {
  EffectKind kind;
  std::function<EchoEffectPtr(const Draws&)> make;
};

}  // namespace cairn::stages
