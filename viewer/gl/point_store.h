// The points of nodes on the graphics card: one buffer of equal slots, allocated once, since all
// nodes have one size. One stream an attribute: the positions of all slots, then their radii,
// colors and normals, as far as there are any; so a point's vertex is slot * capacity + its place,
// for all attributes, and ranges of any slots are one multi-draw.
#pragma once

#include <cstdint>

#include "viewer/gl/gl_object.h"
#include "viewer/renderer.h"

namespace cairn::viewer::gl {

/// Where shaders find the attributes of points and of the items that they are drawn in.
enum class Attribute : GLuint { kPosition, kRadius, kColor, kNormal, kItemOffset, kItemTint };

class PointStore {
 public:
  /// Points are drawn all at once, or in this many groups by their number in the slot, modulo:
  /// neighbors along the curve fall into different groups.
  static constexpr std::uint32_t kGroups = 4;

  /// The buffer has undefined content. Requires slots and points above 0; throws Error (kUsage) for
  /// 2^31 points or more. Whether there was room for it, glGetError tells.
  explicit PointStore(const RendererSize& size);

  /// Requires the columns that the store has, slot < slots, and no more points than a slot holds.
  void upload(std::uint32_t slot, const PointColumns& points);
  /// The vertex of a slot's first point, if all points are drawn at once.
  std::uint32_t first_vertex(std::uint32_t slot) const { return slot * capacity_; }
  /// Binds points and items for drawing all points; items are instances of `items` (GpuItem,
  /// item_list.h).
  void bind(const Buffer& items) const;
  /// Binds one group's points alone: vertex v stands for what is vertex v * kGroups + group
  /// otherwise.
  void bind_group(const Buffer& items, std::uint32_t group) const;

  const RendererSize& size() const { return size_; }

 private:
  struct Stream {
    Attribute attribute;
    GLsizei bytes;  ///< of a point
    GLintptr offset;
  };
  void add_stream(Attribute attribute, GLint components, GLenum type, bool normalized);
  void bind_streams(const Buffer& items, std::uint32_t first, std::uint32_t stride) const;
  void upload_column(Attribute attribute, std::uint32_t slot, const void* data, std::size_t points);

  RendererSize size_;
  std::uint32_t capacity_;  ///< points that a slot has room for: a multiple of kGroups
  VertexArray vertex_array_;
  Buffer buffer_;
  std::vector<Stream> streams_;
};

}  // namespace cairn::viewer::gl
