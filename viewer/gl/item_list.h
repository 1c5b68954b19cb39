// The items of a frame on the graphics card: a command and what differs from item to item, so that
// all of them are one multi-draw a pass. The buffers are of a fixed size; a frame of more items is
// drawn in batches.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "viewer/gl/gl_object.h"
#include "viewer/gl/point_store.h"
#include "viewer/renderer.h"

namespace cairn::viewer::gl {

/// What a shader reads of an item, once an instance.
struct GpuItem {
  glm::vec3 offset;
  std::uint32_t tint;
};
static_assert(sizeof(GpuItem) == 16);

class ItemList {
 public:
  /// Has room for `capacity` items at a time.
  explicit ItemList(std::uint32_t capacity);

  /// Takes the items of a frame, which must stay until the next call. Requires items within the
  /// store's slots.
  void set(const PointStore& store, std::span<const DrawItem> items);
  /// Draws all points of items [first, first + count) with the program and state that are set.
  void draw(const PointStore& store, std::size_t first, std::size_t count);
  /// The same for the points of one group.
  void draw_group(const PointStore& store, std::uint32_t group);

 private:
  static constexpr std::uint32_t kNothing = 0xffffffff;

  void load(const PointStore& store, std::size_t first, std::uint32_t group);
  void multi_draw(std::size_t place, std::size_t count) const;

  std::uint32_t capacity_;
  Buffer items_;
  Buffer commands_;
  std::span<const DrawItem> frame_;
  std::size_t loaded_first_ = 0;           ///< of the batch in the buffers
  std::uint32_t loaded_group_ = kNothing;  ///< kNothing: no batch
  std::vector<GpuItem> gpu_items_;
  std::vector<std::uint32_t> gpu_commands_;
};

}  // namespace cairn::viewer::gl
