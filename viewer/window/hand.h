// What mouse and keyboard of a window do from frame to frame, in the words of
// viewer/window/input.h.
#pragma once

#include <glm/vec3.hpp>

#include "viewer/window/input.h"
#include "viewer/window/window.h"

namespace cairn::viewer {

class Hand {
 public:
  /// The window must outlive it.
  explicit Hand(Window& window) : window_(window) {}

  /// What the mouse did since the last call. What a button moves counts from the second call on
  /// that finds it down.
  MouseMove take_mouse();
  /// Where the keys that are held down fly to, as fly() takes it; letters are among them only in
  /// flight.
  glm::dvec3 along(bool in_flight) const;
  bool shift() const;

 private:
  Window& window_;
  glm::dvec2 pointer_{0, 0};
  bool held_ = false;  ///< a button was down at the last call
};

}  // namespace cairn::viewer
