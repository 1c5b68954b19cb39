#include "tests/bench/synthetic_scan.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace cairn::bench {
namespace {

constexpr double kTau = 2 * std::numbers::pi;

double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Unit vector along `v`; up if `v` vanishes.
Vec3 normalised(Vec3 v) {
  const double length = std::sqrt(dot(v, v));
  return length > 0 ? v * (1 / length) : Vec3{0, 0, 1};
}

/// SplitMix64 (Steele, Lea, Flood 2014).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  /// Uniform in [0, 1).
  double uniform() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15U;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }
  /// Triangular in (-1, 1).
  double noise() { return uniform() - uniform(); }

 private:
  std::uint64_t state_;
};

/// A figure 3 m high on the origin, turned on a lathe: waist, shoulders, folds and a fine grain.
Vec3 statue(double u, double v) {
  const double turn = kTau * u;
  const double body = 0.55 + 0.2 * std::sin(kTau * 1.5 * v + 0.6) + 0.06 * std::sin(kTau * 5 * v);
  const double closed_ends = std::sqrt(std::max(0.0, 1 - std::pow(2 * v - 1, 8)));
  const double folds = 1 + 0.08 * std::sin(9 * turn + 3 * std::sin(kTau * v));
  const double grain = 1 + 0.01 * std::sin(41 * turn) * std::sin(kTau * 37 * v);
  const double radius = body * closed_ends * folds * grain;
  return {radius * std::cos(turn), radius * std::sin(turn), 3 * v};
}

/// 200 m of hills around the origin, octave upon octave, with a levelled square in the middle.
Vec3 terrain(double u, double v) {
  const double x = 200 * (u - 0.5), y = 200 * (v - 0.5);
  double height = 0;
  for (int octave = 0; octave < 6; ++octave) {
    const double frequency = 0.02 * std::exp2(octave), angle = 1.1 * octave;
    const double along = x * std::cos(angle) + y * std::sin(angle);
    const double across = y * std::cos(angle) - x * std::sin(angle);
    height += 4 / std::exp2(octave) * std::sin(frequency * along + octave) *
              std::cos(1.3 * frequency * across);
  }
  const double distance = std::sqrt(x * x + y * y);
  return {x, y, height * std::clamp((distance - 10) / 30, 0.0, 1.0)};
}

/// A wall 24 m wide and 12 m high behind the statue, with recessed windows and courses of brick.
Vec3 facade(double u, double v) {
  const double x = 24 * (u - 0.5), z = 12 * v;
  const auto within = [](double value, double period, double low, double high) {
    const double place = value - period * std::floor(value / period);
    return place > low && place < high;
  };
  const bool window = within(x, 3, 0.8, 2.2) && within(z, 4, 1.2, 3.2);
  const bool mortar = within(z, 0.25, 0, 0.02);
  return {x, 8 + (window ? 0.3 : mortar ? 0.01 : 0.0), z};
}

/// Normal of a surface by differences; it looks to the side from which u runs anticlockwise to v.
Vec3 normal_at(Surface surface, double u, double v) {
  constexpr double kStep = 1e-5;
  const Vec3 along_u = surface(u + kStep, v) - surface(u - kStep, v);
  const Vec3 along_v = surface(u, v + kStep) - surface(u, v - kStep);
  return normalised(cross(along_u, along_v));
}

std::uint8_t to_byte(double value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
}

Point sample(Surface surface, double u, double v, Random& random) {
  constexpr double kRangeNoise = 0.002;  // metres
  const Vec3 normal = normal_at(surface, u, v);
  const Vec3 position = surface(u, v) + normal * (kRangeNoise * random.noise());

  const double light = 0.35 + 0.65 * std::abs(dot(normal, normalised({0.4, -0.6, 0.7})));
  const double speckle = 12 * random.noise();
  const double band = 0.5 + 0.5 * std::sin(1.7 * position.z + 0.8 * std::sin(position.x));
  return {
      position,
      normal,
      {to_byte((130 + 90 * band) * light + speckle), to_byte((150 + 40 * band) * light + speckle),
       to_byte((170 - 80 * band) * light + speckle)},
      static_cast<std::uint16_t>(40000 * light)};
}

}  // namespace

const std::map<std::string, Surface>& shapes() {
  static const std::map<std::string, Surface> table = {
      {"statue", statue}, {"terrain", terrain}, {"facade", facade}};
  return table;
}

void sweep(Surface surface, std::uint64_t count, std::uint64_t seed,
           const std::function<void(const Point&)>& take) {
  Random random(seed);
  const auto rows = static_cast<std::uint64_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  std::uint64_t done = 0;
  for (std::uint64_t row = 0; row < rows; ++row) {
    const std::uint64_t in_row = (count - done) / (rows - row);
    for (std::uint64_t i = 0; i < in_row; ++i) {
      const double step = (static_cast<double>(i) + random.uniform()) / static_cast<double>(in_row);
      const double u = step + 0.12 * std::sin(kTau * step);
      const double v = (static_cast<double>(row) + random.uniform()) / static_cast<double>(rows);
      take(sample(surface, u, v, random));
    }
    done += in_row;
  }
}

}  // namespace cairn::bench
