// The points of a node as a renderer takes them: one column an attribute that the frame's plan calls for, and no other.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace cairn::viewer {

/// Which columns there are. Positions always are.
struct ColumnSet {
  bool radius = false;
  bool color = false;
  bool normal = false;

  /// Bytes that a point takes.
  std::size_t point_bytes() const { return 12u + 4u * (unsigned{radius} + color + normal); }
  bool holds(const ColumnSet& other) const {
    return radius >= other.radius && color >= other.color && normal >= other.normal;
  }
  friend bool operator==(const ColumnSet&, const ColumnSet&) = default;
};

/// Views of columns of equal length; those that are absent are empty.
struct PointColumns {
  std::span<const glm::vec3> position;  ///< world units, from the center of the node's box
  std::span<const float> radius;        ///< world units
  std::span<const std::uint32_t>
      color;  ///< red in the lowest byte, green, blue; the highest byte is 255
  std::span<const std::uint32_t> normal;  ///< pack_normal
};

/// Three signed 10-bit numbers (x lowest), 511 for 1, as GL_INT_2_10_10_10_REV; 0 stands for no normal.
std::uint32_t pack_normal(const glm::vec3& unit);
glm::vec3 unpack_normal(std::uint32_t packed);  ///< unit, or zero

/// Owns the columns of one node.
struct NodePoints {
  std::vector<glm::vec3> position;
  std::vector<float> radius;
  std::vector<std::uint32_t> color;
  std::vector<std::uint32_t> normal;

  PointColumns columns() const { return {position, radius, color, normal}; }
  std::uint32_t count() const { return static_cast<std::uint32_t>(position.size()); }
};

}  // namespace cairn::viewer
