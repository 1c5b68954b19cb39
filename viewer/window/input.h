// What mouse and keys mean: from what a hand did to a changed state, without a window.
#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string_view>

#include "viewer/window/view_state.h"

namespace cairn::viewer {

/// What a mouse did since the last frame; pixels of the picture, to the right and down.
struct MouseMove {
  glm::dvec2 from{0, 0};
  glm::dvec2 to{0, 0};
  bool turns = false;   ///< the left button is held
  bool shifts = false;  ///< the right or middle one is, or the left one with Shift
  double wheel = 0;     ///< steps away from the user
};

/// Moves the camera as a mouse does: around its target, or in flight about its eye. Whether it was
/// moved.
bool steer(ViewState& state, const MouseMove& mouse, PictureSize size);

/// Moves the camera as keys do that were held down for some seconds: `along` right, up and forward,
/// each -1, 0 or 1. Whether it was moved.
bool fly(ViewState& state, const glm::dvec3& along, double seconds, const Box& scene);

/// Does what a pressed key stands for, GLFW's number of it; what remains to be done is added to
/// `actions`.
void press(ViewState& state, int key, const BudgetRange& budgets, Actions& actions);

/// All keys and what the mouse does, for people.
struct HelpLine {
  std::string_view keys;
  std::string_view effect;
};
inline constexpr std::array kHelpLines{
    HelpLine{"left drag", "turn around the target; in flight: look around"},
    HelpLine{"right or Shift drag", "move along the picture"},
    HelpLine{"wheel", "nearer and farther; in flight: faster and slower"},
    HelpLine{"W A S D, arrows", "fly forward, left, back and right (letters: in flight)"},
    HelpLine{"E C, Page Up/Down", "fly up and down (letters: in flight)"},
    HelpLine{"Shift", "fly four times as fast"},
    HelpLine{"Space", "fly, or turn around the target"},
    HelpLine{"Home", "back to the first camera"},
    HelpLine{"[ and ]", "half and double the budget"},
    HelpLine{"1 2 3 0", "points, discs, splats, what the scene calls for"},
    HelpLine{"B", "boxes of the regions that are drawn"},
    HelpLine{"F12, S", "screenshot without the panels (S: not in flight)"},
    HelpLine{"R", "record a walk, and end it"},
    HelpLine{"P", "replay the walk, and stop it"},
    HelpLine{"Tab", "hide and show the panels"},
    HelpLine{"H, F1", "this help"},
    HelpLine{"Esc, Q", "close"},
};

}  // namespace cairn::viewer
