#include "formats/dataset/normal_cone.h"

#include <cmath>

namespace cairn::formats {

std::optional<double> cone_cosine(const NormalCone& cone, const Normal& normal) {
  double dot = 0, axis2 = 0, normal2 = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double u = cone.axis[a];
    const double v = normal[a];
    dot += u * v;
    axis2 += u * u;
    normal2 += v * v;
  }
  const double lengths = std::sqrt(axis2 * normal2);
  if (!(lengths > 0) || !std::isfinite(lengths)) return std::nullopt;
  return dot / lengths;
}

}  // namespace cairn::formats
