#include "viewer/gl/point_store.h"

#include <fmt/format.h>

#include <limits>

#include "formats/error.h"
#include "viewer/gl/item_list.h"

namespace cairn::viewer::gl {
namespace {

std::uint32_t padded(std::uint32_t points) {
  return (points + PointStore::kGroups - 1) / PointStore::kGroups * PointStore::kGroups;
}

void check_size(const RendererSize& size) {
  CAIRN_CHECK(size.slots > 0 && size.slot_points > 0);
  constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
  if (size.slot_points > kMost - PointStore::kGroups ||
      size.slots > kMost / padded(size.slot_points))
    formats::throw_usage(fmt::format(
        "{} slots of {} points are more than the 2^31 - 1 points that OpenGL can number",
        size.slots, size.slot_points));
}

void add_attribute(GLuint array, Attribute attribute, GLuint binding, GLint components, GLenum type,
                   bool normalized, GLuint offset) {
  const auto index = static_cast<GLuint>(attribute);
  glEnableVertexArrayAttrib(array, index);
  glVertexArrayAttribFormat(array, index, components, type, normalized ? GL_TRUE : GL_FALSE,
                            offset);
  glVertexArrayAttribBinding(array, index, binding);
}

constexpr auto kItemBinding = static_cast<GLuint>(Attribute::kItemOffset);

}  // namespace

PointStore::PointStore(const RendererSize& size) : size_(size) {
  check_size(size);
  capacity_ = padded(size.slot_points);
  vertex_array_ = make_vertex_array();
  add_stream(Attribute::kPosition, 3, GL_FLOAT, false);
  if (size.columns.radius) add_stream(Attribute::kRadius, 1, GL_FLOAT, false);
  if (size.columns.color) add_stream(Attribute::kColor, 4, GL_UNSIGNED_BYTE, true);
  if (size.columns.normal) add_stream(Attribute::kNormal, 4, GL_INT_2_10_10_10_REV, true);
  const GLuint array = vertex_array_.name();
  add_attribute(array, Attribute::kItemOffset, kItemBinding, 3, GL_FLOAT, false, 0);
  add_attribute(array, Attribute::kItemTint, kItemBinding, 4, GL_UNSIGNED_BYTE, true,
                offsetof(GpuItem, tint));
  glVertexArrayBindingDivisor(array, kItemBinding, 1);

  buffer_ = make_buffer();
  const auto points = static_cast<GLsizeiptr>(std::uint64_t{size.slots} * capacity_);
  glNamedBufferStorage(buffer_.name(), points * static_cast<GLsizeiptr>(size.columns.point_bytes()),
                       nullptr, GL_DYNAMIC_STORAGE_BIT);
}

void PointStore::add_stream(Attribute attribute, GLint components, GLenum type, bool normalized) {
  const GLintptr end = streams_.empty() ? 0
                                        : streams_.back().offset +
                                              GLintptr{streams_.back().bytes} *
                                                  static_cast<GLintptr>(size_.slots) * capacity_;
  const GLsizei bytes = attribute == Attribute::kPosition ? 12 : 4;
  streams_.push_back({attribute, bytes, end});
  add_attribute(vertex_array_.name(), attribute, static_cast<GLuint>(attribute), components, type,
                normalized, 0);
}

void PointStore::upload_column(Attribute attribute, std::uint32_t slot, const void* data,
                               std::size_t points) {
  for (const Stream& stream : streams_)
    if (stream.attribute == attribute)
      glNamedBufferSubData(buffer_.name(),
                           stream.offset + GLintptr{first_vertex(slot)} * stream.bytes,
                           static_cast<GLsizeiptr>(points) * stream.bytes, data);
}

void PointStore::upload(std::uint32_t slot, const PointColumns& points) {
  const std::size_t count = points.position.size();
  const auto fits = [&](bool there, std::size_t length) { return length == (there ? count : 0); };
  CAIRN_CHECK(slot < size_.slots && count <= size_.slot_points);
  CAIRN_CHECK(fits(size_.columns.radius, points.radius.size()) &&
              fits(size_.columns.color, points.color.size()) &&
              fits(size_.columns.normal, points.normal.size()));
  if (count == 0) return;
  upload_column(Attribute::kPosition, slot, points.position.data(), count);
  upload_column(Attribute::kRadius, slot, points.radius.data(), count);
  upload_column(Attribute::kColor, slot, points.color.data(), count);
  upload_column(Attribute::kNormal, slot, points.normal.data(), count);
}

void PointStore::bind(const Buffer& items) const { bind_streams(items, 0, 1); }

void PointStore::bind_group(const Buffer& items, std::uint32_t group) const {
  bind_streams(items, group, kGroups);
}

void PointStore::bind_streams(const Buffer& items, std::uint32_t first,
                              std::uint32_t stride) const {
  for (const Stream& stream : streams_)
    glVertexArrayVertexBuffer(vertex_array_.name(), static_cast<GLuint>(stream.attribute),
                              buffer_.name(), stream.offset + GLintptr{first} * stream.bytes,
                              static_cast<GLsizei>(stride) * stream.bytes);
  glVertexArrayVertexBuffer(vertex_array_.name(), kItemBinding, items.name(), 0, sizeof(GpuItem));
  glBindVertexArray(vertex_array_.name());
}

}  // namespace cairn::viewer::gl
