#include "stages/simulate/effects/registration_error.h"

namespace cairn::stages {

Station misplaced(Station station, const RegistrationError& error, const Draws& draws) {
  // One pose a station: its numbers are those of ray 0.
  const auto [x, y] = draws.normal(0, 0);
  const auto [z, yaw] = draws.normal(0, 1);
  const auto [pitch, roll] = draws.normal(0, 2);
  const double angle = error.rotation;
  station.position = station.position + Vector3{x, y, z} * error.translation;
  station.turn = product(station.turn, turned(angle * yaw, angle * pitch, angle * roll));
  return station;
}

}  // namespace cairn::stages
