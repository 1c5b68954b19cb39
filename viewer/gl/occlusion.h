// What of a frame is seen, by the card's own occlusion queries.
// Based on: Gobbetti and Marton, "Layered point clouds", 2004, section 4: (1) what was seen a frame
// ago is drawn, (2) the bounds of what was not are tested against it, (3) where such bounds are
// seen, the points are drawn. Where it departs: bounds are boxes; points are counted seen by
// queries around themselves and not by their bounds, so that a region whose box alone is seen does
// not change from hidden to seen and back; and (3) waits on the card and not here, by conditional
// rendering.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "viewer/gl/gl_object.h"
#include "viewer/gl/programs.h"
#include "viewer/renderer.h"

namespace cairn::viewer::gl {

class Occlusion {
 public:
  /// Starts a frame of so many items. Queries are kept for later frames.
  void start(std::size_t items);
  /// Draws an item's points, watching whether any pixel of them is seen.
  template <typename Draw>
  void watch(std::size_t item, Draw&& draw) {
    glBeginQuery(GL_ANY_SAMPLES_PASSED, slots_[item].points.name());
    draw();
    glEndQuery(GL_ANY_SAMPLES_PASSED);
  }
  /// Tests the boxes of the probes among the items against the depth that is bound; draws nothing.
  /// Leaves its own program, and depth and color writable.
  void test_boxes(std::span<const DrawItem> items, const View& view, Programs& programs,
                  GLuint empty_vertex_array);
  /// Draws what belongs to a probe only if its box was seen.
  template <typename Draw>
  void draw_if_seen(std::size_t item, Draw&& draw) {
    const bool asked = slots_[item].asked;
    if (asked) glBeginConditionalRender(slots_[item].box.name(), GL_QUERY_WAIT);
    draw();
    if (asked) glEndConditionalRender();
  }
  /// Waits for the card.
  DrawStatistics results(std::span<const DrawItem> items) const;

 private:
  struct ItemQueries {
    Query points, box;
    bool asked = false;  ///< the box was tested, and not told seen without
  };
  std::vector<ItemQueries> slots_;
};

}  // namespace cairn::viewer::gl
