#include "viewer/cpu/slot_pool.h"

#include <algorithm>
#include <new>
#include <string>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

/// Not written to, so that its pages stay untouched.
template <typename T>
std::unique_ptr<T[]> column(bool wanted, std::size_t points) {
  return wanted ? std::make_unique_for_overwrite<T[]>(points) : nullptr;
}

template <typename T>
void copy(std::span<const T> from, const std::unique_ptr<T[]>& to, std::size_t at,
          std::size_t count) {
  if (!to) return;
  CAIRN_CHECK(from.size() == count);
  std::copy(from.begin(), from.end(), to.get() + at);
}

template <typename T>
const T* behind(const std::unique_ptr<T[]>& column, std::size_t at) {
  return column ? column.get() + at : nullptr;
}

}  // namespace

SlotPool::SlotPool(const RendererSize& size) : size_(size), counts_(size.slots) {
  // Both factors are below 2^32: the product fits.
  const std::size_t points = std::size_t{size.slots} * size.slot_points;
  try {
    x_ = column<float>(true, points);
    y_ = column<float>(true, points);
    z_ = column<float>(true, points);
    radius_ = column<float>(size.columns.radius, points);
    color_ = column<std::uint32_t>(size.columns.color, points);
    normal_ = column<std::uint32_t>(size.columns.normal, points);
  } catch (const std::bad_alloc&) {
    throw formats::Error(
        formats::ErrorKind::kSystem,
        {.what = "no memory for the points to draw: " + std::to_string(size.slots) + " nodes of " +
                 std::to_string(size.slot_points) + " points, " +
                 std::to_string(size.columns.point_bytes()) + " bytes a point"});
  }
}

void SlotPool::put(std::uint32_t slot, const PointColumns& points) {
  const std::size_t count = points.position.size();
  CAIRN_CHECK(slot < size_.slots && count <= size_.slot_points);
  const std::size_t at = std::size_t{slot} * size_.slot_points;
  for (std::size_t i = 0; i < count; ++i) {
    x_[at + i] = points.position[i].x;
    y_[at + i] = points.position[i].y;
    z_[at + i] = points.position[i].z;
  }
  copy(points.radius, radius_, at, count);
  copy(points.color, color_, at, count);
  copy(points.normal, normal_, at, count);
  counts_[slot] = static_cast<std::uint32_t>(count);
}

SlotColumns SlotPool::columns(std::uint32_t slot, std::uint32_t first) const {
  const std::size_t at = std::size_t{slot} * size_.slot_points + first;
  return {.x = x_.get() + at,
          .y = y_.get() + at,
          .z = z_.get() + at,
          .radius = behind(radius_, at),
          .color = behind(color_, at),
          .normal = behind(normal_, at)};
}

}  // namespace cairn::viewer
