#include "viewer/gl/occlusion.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "viewer/gl/shaders.h"

namespace cairn::viewer::gl {
namespace {

constexpr GLsizei kBoxVertices = 36;

bool passed(const Query& query) {
  GLuint any = 0;
  glGetQueryObjectuiv(query.name(), GL_QUERY_RESULT, &any);
  return any != 0;
}

/// A box that is flat or smaller than a pixel would pass between pixels: it is grown by a pixel, as
/// seen at its center.
glm::vec3 grown(const DrawItem& item, const View& view) {
  return item.box_half + glm::length(item.box_center) / static_cast<float>(view.focal_pixels());
}

/// Whether the eye, or the near plane before it, may lie inside.
bool around_eye(const DrawItem& item, const View& view) {
  const glm::vec3 beyond = glm::abs(item.box_center) - grown(item, view);
  return glm::max(beyond.x, glm::max(beyond.y, beyond.z)) <= static_cast<float>(view.near());
}

}  // namespace

void Occlusion::start(std::size_t items) {
  while (slots_.size() < items) slots_.push_back({make_query(), make_query()});
  for (ItemQueries& slot : slots_) slot.asked = false;
}

void Occlusion::test_boxes(std::span<const DrawItem> items, const View& view, Programs& programs,
                           GLuint empty_vertex_array) {
  programs.use(shader::kBox, "");
  glBindVertexArray(empty_vertex_array);
  glDepthMask(GL_FALSE);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  glEnable(GL_DEPTH_CLAMP);  // what lies before the near plane is seen
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (!items[i].probe || around_eye(items[i], view)) continue;
    slots_[i].asked = true;
    const glm::vec3 half = grown(items[i], view);
    glUniform3fv(0, 1, &items[i].box_center.x);
    glUniform3fv(1, 1, &half.x);
    glBeginQuery(GL_ANY_SAMPLES_PASSED, slots_[i].box.name());
    glDrawArrays(GL_TRIANGLES, 0, kBoxVertices);
    glEndQuery(GL_ANY_SAMPLES_PASSED);
  }
  glDisable(GL_DEPTH_CLAMP);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_TRUE);
}

DrawStatistics Occlusion::results(std::span<const DrawItem> items) const {
  DrawStatistics statistics;
  statistics.seen.reserve(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    const bool drawn = !slots_[i].asked || passed(slots_[i].box);
    (drawn ? statistics.points : statistics.unseen_points) += items[i].count;
    const bool told = items[i].probe && !slots_[i].asked;  // the eye is inside
    statistics.seen.push_back({items[i].region, told || (drawn && passed(slots_[i].points))});
  }
  return statistics;
}

}  // namespace cairn::viewer::gl
