#include "viewer/window/input.h"

#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>

#include "viewer/camera_controls.h"

namespace cairn::viewer {
namespace {

constexpr double kSlowest = 1.0 / 64, kFastest = 64;

bool turn_wheel(ViewState& state, double steps) {
  if (steps == 0) return false;
  const double factor = std::pow(kWheelFactor, std::clamp(steps, -50.0, 50.0));
  if (!state.fly) {
    state.camera = zoomed(state.camera, 1 / factor);
    return true;
  }
  state.fly_speed = std::clamp(state.fly_speed * factor, kSlowest, kFastest);
  return false;
}

void scale_budget(ViewState& state, const BudgetRange& budgets, bool twice) {
  const std::uint64_t now = std::min(state.limits.points, budgets.most);
  state.limits.points = std::clamp(twice ? 2 * now : now / 2, budgets.least, budgets.most);
}

}  // namespace

bool steer(ViewState& state, const MouseMove& mouse, PictureSize size) {
  bool moved = turn_wheel(state, mouse.wheel);
  if (mouse.from == mouse.to || !(mouse.turns || mouse.shifts)) return moved;
  if (mouse.shifts)
    state.camera = panned(state.camera, mouse.from, mouse.to, size);
  else if (state.fly)
    state.camera = turned(state.camera, mouse.to - mouse.from, size);
  else
    state.camera = orbited(state.camera, mouse.to - mouse.from, size);
  return true;
}

bool fly(ViewState& state, const glm::dvec3& along, double seconds, const Box& scene) {
  if (along == glm::dvec3(0)) return false;
  const double speed = fly_speed(state.camera.eye, scene) * state.fly_speed;
  state.camera = flown(state.camera, along, speed * seconds);
  return true;
}

void press(ViewState& state, int key, const BudgetRange& budgets, Actions& actions) {
  switch (key) {
    case GLFW_KEY_S:
      if (!state.fly) actions.push_back(Action::kScreenshot);
      break;
    case GLFW_KEY_F12:
      actions.push_back(Action::kScreenshot);
      break;
    case GLFW_KEY_R:
      actions.push_back(Action::kRecord);
      break;
    case GLFW_KEY_P:
      actions.push_back(Action::kReplay);
      break;
    case GLFW_KEY_HOME:
      actions.push_back(Action::kResetCamera);
      break;
    case GLFW_KEY_ESCAPE:
    case GLFW_KEY_Q:
      actions.push_back(Action::kClose);
      break;
    case GLFW_KEY_SPACE:
      state.fly = !state.fly;
      break;
    case GLFW_KEY_B:
      state.boxes = !state.boxes;
      break;
    case GLFW_KEY_TAB:
      state.panel = !state.panel;
      break;
    case GLFW_KEY_H:
    case GLFW_KEY_F1:
      state.help = !state.help;
      break;
    case GLFW_KEY_LEFT_BRACKET:
    case GLFW_KEY_RIGHT_BRACKET:
      scale_budget(state, budgets, key == GLFW_KEY_RIGHT_BRACKET);
      break;
    case GLFW_KEY_0:
      state.wishes.primitive.reset();
      break;
    case GLFW_KEY_1:
      state.wishes.primitive = Primitive::kPoints;
      break;
    case GLFW_KEY_2:
      state.wishes.primitive = Primitive::kDiscs;
      break;
    case GLFW_KEY_3:
      state.wishes.primitive = Primitive::kSplats;
      break;
    default:
      break;
  }
}

}  // namespace cairn::viewer
