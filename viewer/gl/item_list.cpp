#include "viewer/gl/item_list.h"

#include <algorithm>

#include "formats/error.h"

namespace cairn::viewer::gl {
namespace {

/// Of glMultiDrawArraysIndirect: points, instances, first vertex, first instance.
constexpr std::size_t kCommandWords = 4;
constexpr std::size_t kCommandBytes = kCommandWords * sizeof(std::uint32_t);
/// In place of a group: all points.
constexpr std::uint32_t kAll = PointStore::kGroups;

/// How many numbers below `end` are `group` modulo kGroups.
std::uint32_t in_group(std::uint32_t end, std::uint32_t group) {
  return (end + PointStore::kGroups - 1 - group) / PointStore::kGroups;
}

}  // namespace

ItemList::ItemList(std::uint32_t capacity)
    : capacity_(capacity), items_(make_buffer()), commands_(make_buffer()) {
  glNamedBufferStorage(items_.name(), GLsizeiptr{capacity} * GLsizeiptr{sizeof(GpuItem)}, nullptr,
                       GL_DYNAMIC_STORAGE_BIT);
  glNamedBufferStorage(commands_.name(), GLsizeiptr{capacity} * GLsizeiptr{kCommandBytes}, nullptr,
                       GL_DYNAMIC_STORAGE_BIT);
  gpu_items_.reserve(capacity);
  gpu_commands_.reserve(capacity * kCommandWords);
}

void ItemList::set(const PointStore& store, std::span<const DrawItem> items) {
  for (const DrawItem& item : items)
    CAIRN_CHECK(item.slot < store.size().slots && item.first <= store.size().slot_points &&
                item.count <= store.size().slot_points - item.first);
  frame_ = items;
  loaded_group_ = kNothing;
}

void ItemList::load(const PointStore& store, std::size_t first, std::uint32_t group) {
  if (loaded_group_ == group && loaded_first_ == first) return;
  gpu_items_.clear();
  gpu_commands_.clear();
  for (const DrawItem& item :
       frame_.subspan(first, std::min<std::size_t>(capacity_, frame_.size() - first))) {
    std::uint32_t from = store.first_vertex(item.slot) + item.first;
    std::uint32_t end = from + item.count;
    if (group != kAll) {
      from = in_group(from, group);
      end = in_group(end, group);
    }
    const auto instance = static_cast<std::uint32_t>(gpu_items_.size());
    gpu_commands_.insert(gpu_commands_.end(), {end - from, 1, from, instance});
    gpu_items_.push_back({item.offset, item.tint});
  }
  glNamedBufferSubData(items_.name(), 0,
                       static_cast<GLsizeiptr>(gpu_items_.size() * sizeof(GpuItem)),
                       gpu_items_.data());
  glNamedBufferSubData(commands_.name(), 0,
                       static_cast<GLsizeiptr>(gpu_commands_.size() * sizeof(std::uint32_t)),
                       gpu_commands_.data());
  loaded_first_ = first;
  loaded_group_ = group;
}

void ItemList::multi_draw(std::size_t place, std::size_t count) const {
  glBindBuffer(GL_DRAW_INDIRECT_BUFFER, commands_.name());
  // OpenGL takes an offset into the buffer as a pointer.
  const auto* offset = reinterpret_cast<const void*>(  // NOLINT(performance-no-int-to-ptr)
      place * kCommandBytes);
  glMultiDrawArraysIndirect(GL_POINTS, offset, static_cast<GLsizei>(count), 0);
}

void ItemList::draw(const PointStore& store, std::size_t first, std::size_t count) {
  store.bind(items_);
  while (count > 0) {
    const std::size_t batch = first / capacity_ * capacity_;
    const std::size_t now = std::min<std::size_t>(count, batch + capacity_ - first);
    load(store, batch, kAll);
    multi_draw(first - batch, now);
    first += now;
    count -= now;
  }
}

void ItemList::draw_group(const PointStore& store, std::uint32_t group) {
  store.bind_group(items_, group);
  for (std::size_t batch = 0; batch < frame_.size(); batch += capacity_) {
    load(store, batch, group);
    multi_draw(0, std::min<std::size_t>(capacity_, frame_.size() - batch));
  }
}

}  // namespace cairn::viewer::gl
