#include "stages/simulate/effects/station_effects.h"

#include <algorithm>

namespace cairn::stages {

StationEffects::StationEffects(const Effects& effects, std::size_t station)
    : seed_(effects.seed),
      station_(static_cast<std::uint32_t>(station)),
      registration_error_(effects.registration_error),
      moving_objects_(effects.moving_objects) {
  for (const ChosenEffect& chosen : effects.of_echoes)
    of_echoes_.push_back({chosen.kind, chosen.make(draws(chosen.kind))});
  std::sort(of_echoes_.begin(), of_echoes_.end(),
            [](const Made& a, const Made& b) { return a.kind < b.kind; });
}

Draws StationEffects::draws(EffectKind kind) const {
  return {seed_, station_, static_cast<std::uint32_t>(kind)};
}

Station StationEffects::recorded(const Station& station) const {
  if (!registration_error_) return station;
  return misplaced(station, *registration_error_, draws(EffectKind::kRegistrationError));
}

bool StationEffects::passes_foliage() const {
  return std::ranges::any_of(of_echoes_,
                             [](const Made& made) { return made.kind == EffectKind::kFoliage; });
}

std::uint64_t StationEffects::most_echoes() const {
  std::uint64_t most = 1;
  for (const Made& made : of_echoes_) most = std::max(most, made.effect->most_echoes());
  return most;
}

void StationEffects::apply(const Beam& beam, RayEchoes& echoes, EffectCalls& calls) const {
  for (const Made& made : of_echoes_) {
    made.effect->apply(beam, echoes);
    ++calls[static_cast<std::size_t>(made.kind)];
  }
  drop_and_number(beam, echoes);
}

void StationEffects::drop_and_number(const Beam& beam, RayEchoes& echoes) {
  // The range gate: what seems to lie outside is not told.
  echoes.remove_if(
      [&](const Echo& echo) { return !(echo.range > 0 && echo.range <= beam.max_range); });
  const auto count = static_cast<std::uint8_t>(echoes.end() - echoes.begin());
  std::uint8_t number = 0;
  for (Echo& echo : echoes) {
    echo.return_number = ++number;
    echo.return_count = count;
  }
}

EffectCalls StationEffects::other_calls(std::uint64_t rays) const {
  EffectCalls calls{};
  calls[static_cast<std::size_t>(EffectKind::kMovingObjects)] = moving_objects_ ? rays : 0;
  calls[static_cast<std::size_t>(EffectKind::kRegistrationError)] = registration_error_ ? 1 : 0;
  return calls;
}

}  // namespace cairn::stages
