// Based on: John C. Hart, "Sphere tracing: a geometric method for the antialiased ray tracing of implicit
// surfaces", The Visual Computer 1996. It departs from it in that a bounding volume hierarchy over cells finds
// the few stretches of a ray that are near the surface, and that a change of sign, once seen, is narrowed down
// to the last digits.
#include "stages/simulate/statue.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace cairn::stages {
namespace {

// All in units of the figure's height.
struct Cone {
  Vector3 from, to;
  double from_radius, to_radius;
};
constexpr auto kCones = std::to_array<Cone>({
    {{0, 0, 0.10}, {0, 0, 0.50}, 0.150, 0.092},                     // robe
    {{0, 0, 0.50}, {0.005, 0, 0.74}, 0.092, 0.110},                 // chest
    {{0.005, -0.10, 0.775}, {0.005, 0.10, 0.775}, 0.048, 0.048},    // shoulders
    {{0.005, 0, 0.78}, {0.012, 0, 0.86}, 0.042, 0.036},             // neck
    {{0.012, 0, 0.915}, {0.030, 0, 0.900}, 0.072, 0.058},           // head
    {{0.075, 0, 0.915}, {0.092, 0, 0.893}, 0.012, 0.014},           // nose
    {{-0.025, 0, 0.955}, {-0.055, 0, 0.935}, 0.045, 0.030},         // hair
    {{0.005, 0.135, 0.76}, {0.030, 0.195, 0.565}, 0.043, 0.034},    // left upper arm
    {{0.030, 0.195, 0.565}, {0.150, 0.085, 0.53}, 0.034, 0.026},    // left forearm
    {{0.150, 0.085, 0.53}, {0.185, 0.045, 0.54}, 0.026, 0.018},     // left hand
    {{0.005, -0.135, 0.76}, {0.040, -0.205, 0.60}, 0.043, 0.034},   // right upper arm
    {{0.040, -0.205, 0.60}, {0.150, -0.175, 0.74}, 0.034, 0.025},   // right forearm, raised
    {{0.150, -0.175, 0.74}, {0.175, -0.165, 0.80}, 0.025, 0.017},   // right hand
    {{0.10, 0.055, 0.020}, {0.165, 0.062, 0.015}, 0.030, 0.022},    // left foot
    {{0.10, -0.055, 0.020}, {0.175, -0.062, 0.015}, 0.030, 0.022},  // right foot
});
/// Surfaces closer than this melt into one.
constexpr double kBlend = 0.035;

/// amplitude * sin(fx x) sin(fy y) sin(fz z + shift).
struct Wave {
  double amplitude;
  Vector3 frequency;
};
constexpr auto kWaves = std::to_array<Wave>({
    {0.0060, {62, 58, 9}},      // folds that fall
    {0.0009, {290, 310, 270}},  // grain of the stone
});
constexpr double kWaveShift = 0.5;

/// Cells along the height.
constexpr std::uint32_t kCells = 96;
constexpr double kCell = 1.0 / kCells;
constexpr std::uint32_t kCellsAcross = 56;
constexpr Vector3 kCorner{-0.5 * kCellsAcross * kCell, -0.5 * kCellsAcross* kCell, -0.08};
constexpr std::uint32_t kCellsUp = kCells + 12;
/// Two changes of sign closer than this may be missed where a ray grazes the surface.
constexpr double kLeastStep = kCell / 200;

/// About the largest curvature, that of the grain: amplitude times frequency squared.
constexpr double kSharpest = 81;

/// The field of what counts as on the surface.
constexpr double kOnSurface = 1e-12;

/// The centre of the ball of the cone that is nearest to `p`, and its radius.
struct Ball {
  Vector3 centre;
  double radius;
};

Ball nearest_ball(const Cone& cone, const Vector3& p) {
  const Vector3 span = cone.to - cone.from;
  const double size = length(span);
  const Vector3 along = span * (1 / size);
  const Vector3 q = p - cone.from;
  const double s = dot(q, along);
  const double slope = (cone.from_radius - cone.to_radius) / size;
  const double aside = std::sqrt(std::max(0.0, dot(q, q) - s * s));
  const double at = std::clamp(s - slope * aside / std::sqrt(1 - slope * slope), 0.0, size);
  return {cone.from + along * at, cone.from_radius - slope * at};
}

double distance_to(const Cone& cone, const Vector3& p) {
  const Ball ball = nearest_ball(cone, p);
  return length(p - ball.centre) - ball.radius;
}

/// The smooth union of distances d_i: the m at which the sum of (1 - (d_i - m) / kBlend)^2, over the d_i below
/// m + kBlend, is 1. It is no more than the least of them, depends on no order, and what is farther than kBlend
/// from it has no part in it. Its slope is the mean of theirs, with the terms under the square as weights.
struct Union {
  double distance = kNoHit;
  std::size_t count = 0;
  std::array<std::size_t, kCones.size()>
      cones;  ///< the first `count`: those that take part, nearest first
  std::array<double, kCones.size()> weights;  ///< of these
};

Union smooth_union(const Vector3& p, std::uint32_t parts) {
  Union result;
  std::array<double, kCones.size()> distances;
  std::size_t candidates = 0;
  for (std::size_t i = 0; i < kCones.size(); ++i) {
    if ((parts >> i & 1) == 0) continue;
    const double distance = distance_to(kCones[i], p);
    std::size_t at = candidates++;
    for (; at > 0 && distances[at - 1] > distance; --at) {
      distances[at] = distances[at - 1];
      result.cones[at] = result.cones[at - 1];
    }
    distances[at] = distance;
    result.cones[at] = i;
  }
  const double least = distances[0];
  // In units of kBlend below the least; each that joins draws the union farther down.
  double u = 0, sum = 0, squares = 0;
  for (; result.count < candidates; ++result.count) {
    const double e = 1 - (distances[result.count] - least) / kBlend;
    if (!(e + u > 0)) break;
    sum += e;
    squares += e * e;
    const auto n = static_cast<double>(result.count + 1);
    u = (std::sqrt(std::max(0.0, sum * sum - n * (squares - 1))) - sum) / n;
    result.weights[result.count] = e;
  }
  for (std::size_t i = 0; i < result.count; ++i) result.weights[i] += u;
  result.distance = least + kBlend * u;
  return result;
}

Vector3 waves_at(const Wave& wave, const Vector3& p) {
  return {wave.frequency[0] * p[0], wave.frequency[1] * p[1],
          wave.frequency[2] * p[2] + kWaveShift};
}

}  // namespace

double Statue::steepest() {
  double sum = 1;
  for (const Wave& wave : kWaves)
    sum += wave.amplitude * *std::max_element(wave.frequency.begin(), wave.frequency.end());
  return sum;
}

Statue::Statue(double height) : height_(height) { find_cells(); }

double Statue::value(const Vector3& p, Parts parts) const {
  double sum = smooth_union(p, parts).distance;
  for (const Wave& wave : kWaves) {
    const Vector3 a = waves_at(wave, p);
    sum -= wave.amplitude * std::sin(a[0]) * std::sin(a[1]) * std::sin(a[2]);
  }
  return sum;
}

Vector3 Statue::gradient(const Vector3& p, Parts parts) const {
  const Union joined = smooth_union(p, parts);
  Vector3 slope{};
  double weights = 0;
  for (std::size_t i = 0; i < joined.count; ++i) {
    const Ball ball = nearest_ball(kCones[joined.cones[i]], p);
    slope = slope + normalised(p - ball.centre) * joined.weights[i];
    weights += joined.weights[i];
  }
  slope = slope * (1 / weights);
  for (const Wave& wave : kWaves) {
    const Vector3 a = waves_at(wave, p);
    const Vector3 s{std::sin(a[0]), std::sin(a[1]), std::sin(a[2])};
    const Vector3 c{std::cos(a[0]), std::cos(a[1]), std::cos(a[2])};
    const Vector3 rise{wave.frequency[0] * c[0] * s[1] * s[2],
                       wave.frequency[1] * s[0] * c[1] * s[2],
                       wave.frequency[2] * s[0] * s[1] * c[2]};
    slope = slope - rise * wave.amplitude;
  }
  return slope;
}

void Statue::find_cells() {
  const double reach = kCell * std::sqrt(3.0) / 2;  // from the centre of a cell to its corners
  for (std::uint32_t z = 0; z < kCellsUp; ++z)
    for (std::uint32_t y = 0; y < kCellsAcross; ++y)
      for (std::uint32_t x = 0; x < kCellsAcross; ++x) {
        const Vector3 centre = kCorner + Vector3{x + 0.5, y + 0.5, z + 0.5} * kCell;
        if (std::fabs(value(centre, kAll)) > steepest() * reach) continue;
        std::array<double, kCones.size()> distances{};
        std::transform(kCones.begin(), kCones.end(), distances.begin(),
                       [&](const Cone& cone) { return distance_to(cone, centre); });
        const double least = *std::min_element(distances.begin(), distances.end());
        // A cone that is farther than this everywhere in the cell leaves the union as it is.
        Parts parts = 0;
        for (std::size_t i = 0; i < kCones.size(); ++i)
          if (distances[i] <= least + 2 * reach + kBlend) parts |= Parts{1} << i;
        cells_.push_back({x, y, z, parts});
      }
}

Box Statue::bounds(std::size_t piece) const {
  // Neighbours compute the face between them alike, so no ray passes between their stretches.
  const Cell& cell = cells_[piece];
  const auto corner = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return (kCorner + Vector3{x * kCell, y * kCell, z * kCell}) * height_;
  };
  return {corner(cell.x, cell.y, cell.z), corner(cell.x + 1, cell.y + 1, cell.z + 1)};
}

double Statue::intersect(std::size_t piece, const Ray& ray) const {
  const Box box = bounds(piece);
  double begin = 0, end = kNoHit;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double origin = ray.origin[axis], direction = ray.direction[axis];
    if (direction == 0) {
      if (origin < box.min[axis] || origin > box.max[axis]) return kNoHit;
      continue;
    }
    const double a = (box.min[axis] - origin) / direction;
    const double b = (box.max[axis] - origin) / direction;
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  if (!(begin <= end)) return kNoHit;
  const Ray unit{ray.origin * (1 / height_), ray.direction};
  return height_ * first_root(unit, begin / height_, end / height_, cells_[piece].parts);
}

double Statue::first_root(const Ray& ray, double begin, double end, Parts parts) const {
  const auto at = [&](double t) { return value(ray.origin + ray.direction * t, parts); };
  double low = begin, low_value = at(low);
  if (low_value <= 0) return low_value == 0 ? low : kNoHit;  // the cell before has the root
  const double slowest = 1 / steepest();
  while (low < end) {
    double high = std::min(end, low + std::max(low_value * slowest, kLeastStep));
    double high_value = at(high);
    if (high_value > 0) {
      low = high;
      low_value = high_value;
      continue;
    }
    // Secants with the Illinois rule, which never leave the bracket.
    for (int round = 0; round < 60 && high_value < 0; ++round) {
      const double t = (low * high_value - high * low_value) / (high_value - low_value);
      if (!(t > low) || !(t < high)) break;
      const double t_value = at(t);
      if (t_value > 0) {
        low = t;
        low_value = t_value;
        high_value /= 2;
      } else {
        high = t;
        high_value = t_value;
        low_value /= 2;
      }
    }
    return high;
  }
  return kNoHit;
}

/// Newton's method, along the gradient. Where the field is 0 as far as digits go; it may end elsewhere.
Vector3 Statue::onto_surface(Vector3 p) const {
  for (int round = 0; round < 8; ++round) {
    const double field = value(p, kAll);
    if (std::fabs(field) < kOnSurface) break;
    const Vector3 slope = gradient(p, kAll);
    p = p - slope * (field / std::max(dot(slope, slope), 0.1));
  }
  return p;
}

double Statue::distance(std::size_t piece, const Vector3& point) const {
  const Vector3 p = point * (1 / height_);
  const Box box = bounds(piece);
  Vector3 q;
  for (std::size_t axis = 0; axis < 3; ++axis)
    q[axis] = std::clamp(point[axis], box.min[axis], box.max[axis]) / height_;
  double nearest = kNoHit;
  for (int round = 0; round < 24; ++round) {
    q = onto_surface(q);
    const Vector3 away = p - q;
    const double size = length(away);
    if (std::fabs(value(q, kAll)) < kOnSurface) nearest = std::min(nearest, size);
    const Vector3 normal = normalised(gradient(q, kAll));
    const Vector3 aside = away - normal * dot(away, normal);
    // What is left of the way enters the distance by its square.
    if (length(aside) <= 1e-4 * size + kOnSurface) break;
    // Along the surface towards the point, the less far the more it may bend meanwhile.
    q = q + aside * std::min(1 / (1 + kSharpest * size), kCell / 8 / length(aside));
  }
  return height_ * nearest;
}

Vector3 Statue::normal(std::size_t piece, const Vector3& point) const {
  return normalised(gradient(point * (1 / height_), cells_[piece].parts));
}

}  // namespace cairn::stages
