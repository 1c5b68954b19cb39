// What arithmetic did to the points of a node or of a level, as metadata.json tells it. Counts and largest values only, so
// that adding up knows no order.
#pragma once

#include <algorithm>
#include <cstdint>

namespace cairn::formats {

/// How far decoded values are from what was encoded, at most; `bound`: and could have been.
struct QuantizationError {
  double largest = 0;
  double bound = 0;

  void add(const QuantizationError& other) {
    largest = std::max(largest, other.largest);
    bound = std::max(bound, other.bound);
  }
};

struct QuantizationErrors {
  QuantizationError position;  ///< distance, world units
  QuantizationError radius;    ///< world units
  QuantizationError normal;    ///< degrees

  void add(const QuantizationErrors& other) {
    position.add(other.position);
    radius.add(other.radius);
    normal.add(other.normal);
  }
};

struct Numerics {
  // Of the mergings that its points were made by, one for each child:
  std::uint64_t relaxed_theta = 0;   ///< merged normals farther apart than theta asks for
  std::uint64_t coarsened_grid = 0;  ///< ended on a coarser grid than they began on
  /// Points whose normals cancel: they have that of the heaviest point that they stand for.
  std::uint64_t cancelled_normals = 0;
  QuantizationErrors quantization;

  void add(const Numerics& other) {
    relaxed_theta += other.relaxed_theta;
    coarsened_grid += other.coarsened_grid;
    cancelled_normals += other.cancelled_normals;
    quantization.add(other.quantization);
  }
};

}  // namespace cairn::formats
