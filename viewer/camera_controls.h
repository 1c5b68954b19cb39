// What a hand does to a camera, as functions from camera to camera. Two ways: around a target that stays, and through the
// scene as an eye that turns. Distances in the picture are pixels, to the right and down, as a mouse tells them.
//
// All of them take a valid camera (fault_of) and give one: the line of sight comes no nearer to the up direction than
// kPoleMargin, the eye never reaches the target, and a move that ends beyond what coordinates can tell is not made.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "viewer/camera.h"

namespace cairn::viewer {

/// Radians. A camera that is nearer to its up direction already may stay so, but comes no nearer.
inline constexpr double kPoleMargin = 0.02;
/// One step of a wheel, away from the target.
inline constexpr double kWheelFactor = 1.2;

/// Turns the eye around the target, as if the scene were dragged along: half a turn for the picture's height. Keeps the
/// distance.
Camera orbited(const Camera& camera, const glm::dvec2& drag, PictureSize size);

/// Moves the eye along the line of sight, so that its distance from the target is this many times as large. It stays
/// within what coordinates can tell: at least 1e-10 of the target's largest coordinate, at most 1e15 world units. Requires a
/// finite factor above 0.
Camera zoomed(const Camera& camera, double factor);

/// Shifts eye and target along the picture so that what is seen under `from`, at the target's depth, is under `to` then.
Camera panned(const Camera& camera, const glm::dvec2& from, const glm::dvec2& to, PictureSize size);

/// Turns the line of sight about the eye, to the right for a move to the right, by the field of view for the picture's
/// height. Keeps the distance to the target.
Camera turned(const Camera& camera, const glm::dvec2& move, PictureSize size);

/// Moves eye and target along the picture's axes: right, up and forward, each from -1 to 1, as keys are held down. What
/// is longer than 1 together counts as 1, so that no direction is faster. `distance` is in world units.
Camera flown(const Camera& camera, const glm::dvec3& along, double distance);

/// World units a second at which to fly: half the way to the scene, and inside of it a twentieth of its radius.
double fly_speed(const glm::dvec3& eye, const Box& scene);

}  // namespace cairn::viewer
