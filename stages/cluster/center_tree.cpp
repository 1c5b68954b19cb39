#include "stages/cluster/center_tree.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <utility>

#include "formats/error.h"
#include "formats/vector_path.h"
#include "stages/cluster/normals.h"

namespace cairn::stages {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();

/// Covers the rounding of squared distances in single precision.
constexpr float kRoundUp = 1 + 1e-5F;
/// Of a coordinate: covers its rounding to single precision.
constexpr float kCoordinateError = 2.4e-7F;

float rounded_down(float coordinate) {
  return coordinate - (coordinate < 0 ? -coordinate : coordinate) * kCoordinateError;
}
float rounded_up(float coordinate) {
  return coordinate + (coordinate < 0 ? -coordinate : coordinate) * kCoordinateError;
}

/// One number or the other, of which one at least is not positive; 0 if both are. Chosen without asking for the larger of
/// them first, of which GCC makes branches, and no vectors where there are no masks.
float positive_of(float a, float b) { return (a > 0 ? a : 0) + (b > 0 ? b : 0); }

template <typename Lanes>
float least_of(const Lanes& lanes) {
  float least = kInfinite;
#pragma omp simd reduction(min : least)
  for (std::size_t k = 0; k < lanes.size(); ++k) least = lanes[k] < least ? lanes[k] : least;
  return least;
}
template <typename Lanes>
float largest_of(const Lanes& lanes) {
  float largest = -kInfinite;
#pragma omp simd reduction(max : largest)
  for (std::size_t k = 0; k < lanes.size(); ++k) largest = lanes[k] > largest ? lanes[k] : largest;
  return largest;
}

}  // namespace

CenterTree::CenterTree(CurvePoints centers) : centers_(std::move(centers)) {
  CAIRN_CHECK(centers_.count() > 0);
  const std::size_t runs = (centers_.count() + kLanes - 1) / kLanes;
  for (std::vector<double>* column : {&centers_.x, &centers_.y, &centers_.z})
    column->resize(runs * kLanes, std::numeric_limits<double>::infinity());
  if (centers_.has_normals())
    for (std::vector<float>* column : {&centers_.nx, &centers_.ny, &centers_.nz})
      column->resize(runs * kLanes);

  Boxes nothing;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    nothing.low[axis].fill(kInfinite);
    nothing.high[axis].fill(-kInfinite);
  }
  const auto parents_of = [](std::size_t count) { return (count + kLanes - 1) / kLanes; };
  std::vector<Boxes> lowest(parents_of(runs), nothing);
  const std::array<const std::vector<double>*, 3> columns{&centers_.x, &centers_.y, &centers_.z};
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t run = 0; run < runs; ++run) {
      const double* at = columns[axis]->data() + run * kLanes;
      double low = at[0], high = at[0];
      for (std::uint32_t k = 1; k < kLanes && at[k] < kInfinite; ++k) {
        low = std::min(low, at[k]);
        high = std::max(high, at[k]);
      }
      lowest[run / kLanes].low[axis][run % kLanes] = rounded_down(static_cast<float>(low));
      lowest[run / kLanes].high[axis][run % kLanes] = rounded_up(static_cast<float>(high));
    }
  boxes_.push_back(std::move(lowest));
  while (boxes_.back().size() > 1) {
    const std::vector<Boxes>& below = boxes_.back();
    std::vector<Boxes> level(parents_of(below.size()), nothing);
    for (std::size_t i = 0; i < below.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        level[i / kLanes].low[axis][i % kLanes] = least_of(below[i].low[axis]);
        level[i / kLanes].high[axis][i % kLanes] = largest_of(below[i].high[axis]);
      }
    boxes_.push_back(std::move(level));
  }
}

/// The search of one run of points after the other.
class PacketSearch {
 public:
  PacketSearch(const CenterTree& tree, const CurvePoints& points, float min_cosine,
               std::span<std::uint32_t> center_of)
      : tree_(tree), points_(points), min_cosine_(min_cosine), center_of_(center_of) {}

  template <bool kNormals>
  void run() {
    for (std::size_t first = 0; first < points_.count(); first += kLanes) {
      // Points far from each other, as where the curve leaps, are searched for apart: at last each on its own.
      std::array<Range, 2 * kLanes> parts;
      std::size_t count = 0;
      parts[count++] = {first, std::min<std::size_t>(kLanes, points_.count() - first)};
      while (count > 0) {
        const Range part = parts[--count];
        load<kNormals>(part);
        if (part.count > 1 && (scattered() || !search<kNormals>(false))) {
          const std::size_t before = points_before_leap(part.count);
          parts[count++] = {part.first + before, part.count - before};
          parts[count++] = {part.first, before};
          continue;
        }
        if (part.count == 1) search<kNormals>(true);
        for (std::size_t k = 0; k < part.count; ++k) center_of_[part.first + k] = nearest_[k];
      }
    }
  }

 private:
  static constexpr std::uint32_t kLanes = CenterTree::kLanes;
  template <typename T>
  using Lanes = CenterTree::Lanes<T>;

  struct Range {
    std::size_t first, count;
  };
  struct Step {
    std::uint32_t level, node;
  };

  /// Centers that may be nearest to one of the points, before they are compared.
  static constexpr std::uint32_t kMostCandidates = 128;
  /// Points whose box is so many times as large as the way to their centers are too scattered to search for together.
  static constexpr float kScattered = 32;

  /// Beyond the last point of the range stands this one again.
  template <typename T>
  static Lanes<T> lanes_of(const T* column, const Range& range) {
    Lanes<T> lanes;
    const T* const from = column + range.first;
    if (range.count == kLanes) {
      std::copy_n(from, kLanes, lanes.begin());
      return lanes;
    }
    for (std::size_t k = 0; k < kLanes; ++k) lanes[k] = from[std::min(k, range.count - 1)];
    return lanes;
  }

  template <bool kNormals>
  void load(const Range& range) {
    nearest_ = lanes_of(center_of_.data(), range);
    const std::array<const double*, 3> at{points_.x.data(), points_.y.data(), points_.z.data()};
    const std::array<const double*, 3> to{tree_.centers_.x.data(), tree_.centers_.y.data(),
                                          tree_.centers_.z.data()};
    square_.fill(0);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Lanes<double> place = lanes_of(at[axis], range);
      origin_[axis] = place[0];
#pragma omp simd
      for (std::uint32_t k = 0; k < kLanes; ++k)
        point_[axis][k] = static_cast<float>(place[k] - place[0]);
#pragma omp simd
      for (std::uint32_t k = 0; k < kLanes; ++k) {
        const float way = point_[axis][k] - static_cast<float>(to[axis][nearest_[k]] - place[0]);
        square_[k] += way * way;
      }
    }
    if constexpr (kNormals) load_normals(range);
    set_limit();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float low = least_of(point_[axis]), high = largest_of(point_[axis]);
      low_[axis] = rounded_down(low);
      high_[axis] = rounded_up(high);
      const double margin = double{high - low} * kCoordinateError;
      low_in_tree_[axis] = rounded_down(static_cast<float>(origin_[axis] + low - margin));
      high_in_tree_[axis] = rounded_up(static_cast<float>(origin_[axis] + high + margin));
    }
  }

  void load_normals(const Range& range) {
#pragma omp simd
    for (std::uint32_t k = 0; k < kLanes; ++k) {
      const std::size_t i = range.first + std::min<std::size_t>(k, range.count - 1);
      const formats::Normal own = points_.normal_of(i);
      normal_[0][k] = own[0];
      normal_[1][k] = own[1];
      normal_[2][k] = own[2];
      const float agreed = agreement(own, tree_.centers_.normal_of(nearest_[k]));
      // A point without a normal may go anywhere.
      least_[k] = is_direction(own) ? std::min(min_cosine_, agreed) : -kInfinite;
    }
  }

  /// How many points come before the longest way from one of several to the next.
  std::size_t points_before_leap(std::size_t count) const {
    std::size_t before = 1;
    float longest = -1;
    for (std::size_t k = 1; k < count; ++k) {
      float square = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float way = point_[axis][k] - point_[axis][k - 1];
        square += way * way;
      }
      if (square > longest) {
        longest = square;
        before = k;
      }
    }
    return before;
  }

  /// Of centers that count; in the tree, whose boxes are rounded, a little more.
  void set_limit() {
    limit_ = largest_of(square_);
    limit_in_tree_ = limit_ * kRoundUp;
  }

  bool scattered() const {
    float longest = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      longest = std::max(longest, high_[axis] - low_[axis]);
    return longest * longest > kScattered * kScattered * limit_;
  }

  /// Whether all that may be nearest was looked at; unless `all` is asked for, no more than kMostCandidates are.
  template <bool kNormals>
  bool search(bool all) {
    candidates_ = 0;
    std::array<Step, std::size_t{kLanes} * CenterTree::kMostLevels> steps;
    std::size_t count = 0;
    steps[count++] = {static_cast<std::uint32_t>(tree_.boxes_.size()), 0};
    while (count > 0) {
      const Step step = steps[--count];
      if (step.level == 0) {
        if (candidates_ + kLanes > kMostCandidates) {
          if (!all) return false;
          compare<kNormals>();
          set_limit();
        }
        collect<kNormals>(step.node);
        continue;
      }
      std::uint32_t near = children_within(tree_.boxes_[step.level - 1][step.node]);
      while (near != 0) {  // the first comes last on the stack
        const auto k = static_cast<std::uint32_t>(std::bit_width(near) - 1);
        near ^= 1U << k;
        steps[count++] = {step.level - 1, kLanes * step.node + k};
      }
    }
    compare<kNormals>();
    return true;
  }

  static std::uint32_t bits_below(const Lanes<float>& squares, float limit) {
    alignas(16) Lanes<std::uint8_t> below;
#pragma omp simd
    for (std::uint32_t k = 0; k < kLanes; ++k) below[k] = squares[k] < limit ? 1 : 0;
    // Times this, byte k of eight that are 0 or 1 comes to stand as bit k of the highest byte.
    constexpr std::uint64_t kGather = 0x0102040810204080;
    std::array<std::uint64_t, 2> halves;
    std::memcpy(halves.data(), below.data(), sizeof(halves));
    return static_cast<std::uint32_t>(halves[0] * kGather >> 56 | halves[1] * kGather >> 56 << 8);
  }

  std::uint32_t children_within(const CenterTree::Boxes& boxes) const {
    alignas(64) Lanes<float> squares{};
    for (std::size_t axis = 0; axis < 3; ++axis)
#pragma omp simd
      for (std::uint32_t k = 0; k < kLanes; ++k) {
        const float below = boxes.low[axis][k] - high_in_tree_[axis];
        const float above = low_in_tree_[axis] - boxes.high[axis][k];
        const float outside = positive_of(below, above);
        squares[k] += outside * outside;
      }
    return bits_below(squares, limit_in_tree_);
  }

  /// Notes the centers of a run that are within the limit of the points' box.
  template <bool kNormals>
  void collect(std::uint32_t run) {
    const std::size_t first = std::size_t{run} * kLanes;
    const std::array<const double*, 3> at{tree_.centers_.x.data() + first,
                                          tree_.centers_.y.data() + first,
                                          tree_.centers_.z.data() + first};
    alignas(64) std::array<Lanes<float>, 3> center;
    alignas(64) Lanes<float> squares{};
    for (std::size_t axis = 0; axis < 3; ++axis)
#pragma omp simd
      for (std::uint32_t k = 0; k < kLanes; ++k) {
        center[axis][k] = static_cast<float>(at[axis][k] - origin_[axis]);
        const float below = low_[axis] - center[axis][k], above = center[axis][k] - high_[axis];
        const float outside = positive_of(below, above);
        squares[k] += outside * outside;
      }
    for (std::uint32_t near = bits_below(squares, limit_); near != 0; near &= near - 1) {
      const auto k = static_cast<std::uint32_t>(std::countr_zero(near));
      Candidate& candidate = candidate_[candidates_++];
      candidate.center = static_cast<std::uint32_t>(first) + k;
      candidate.place = {center[0][k], center[1][k], center[2][k]};
      if constexpr (kNormals) {
        candidate.normal = tree_.centers_.normal_of(first + k);
        candidate.bonus = is_direction(candidate.normal) ? 0.0F : 1.0F;
      }
    }
  }

  /// Compares the candidates with what is known as nearest. Of equally near ones the first stays.
  template <bool kNormals>
  void compare() {
    // Numbers that are not negative are in the order of their bits. Of conditions on floats GCC makes branches, and no
    // vectors.
    alignas(64) auto square = std::bit_cast<Lanes<std::int32_t>>(square_);
    alignas(64) Lanes<std::uint32_t> nearest = nearest_;
    for (std::uint32_t c = 0; c < candidates_; ++c) {
      const Candidate candidate = candidate_[c];
#pragma omp simd
      for (std::uint32_t k = 0; k < kLanes; ++k) {
        const float x = point_[0][k] - candidate.place[0], y = point_[1][k] - candidate.place[1],
                    z = point_[2][k] - candidate.place[2];
        const float now = x * x + y * y + z * z;
        std::int32_t bits = std::bit_cast<std::int32_t>(now);
        if constexpr (kNormals) {
          const float agreed = normal_[0][k] * candidate.normal[0] +
                               normal_[1][k] * candidate.normal[1] +
                               normal_[2][k] * candidate.normal[2] + candidate.bonus;
          bits |= agreed >= least_[k] ? 0 : std::numeric_limits<std::int32_t>::max();
        }
        const bool closer = bits < square[k];
        square[k] = closer ? bits : square[k];
        nearest[k] = closer ? candidate.center : nearest[k];
      }
    }
    square_ = std::bit_cast<Lanes<float>>(square);
    nearest_ = nearest;
    candidates_ = 0;
  }

  struct Candidate {
    std::uint32_t center;
    std::array<float, 3> place;  ///< from the origin
    formats::Normal normal{};
    float bonus = 0;  ///< of one without a normal, which agrees with every other
  };

  const CenterTree& tree_;
  const CurvePoints& points_;
  const float min_cosine_;
  const std::span<std::uint32_t> center_of_;

  std::array<double, 3> origin_;  ///< of the points' coordinates: one of them
  alignas(64) std::array<Lanes<float>, 3> point_;
  alignas(64) std::array<Lanes<float>, 3> normal_;
  alignas(64) Lanes<float> least_;   ///< agreement of normals that a center needs
  alignas(64) Lanes<float> square_;  ///< of the distance to the nearest center so far
  alignas(64) Lanes<std::uint32_t> nearest_;
  float limit_, limit_in_tree_;                      ///< of squared distances that matter
  std::array<float, 3> low_, high_;                  ///< the points' box
  std::array<float, 3> low_in_tree_, high_in_tree_;  ///< in the coordinates of the tree
  std::array<Candidate, kMostCandidates> candidate_;
  std::uint32_t candidates_ = 0;
};

namespace {

void run_with_normals(PacketSearch& search) { search.run<true>(); }
void run_without_normals(PacketSearch& search) { search.run<false>(); }

}  // namespace

void CenterTree::move_to_nearest(const CurvePoints& points, float min_cosine,
                                 std::span<std::uint32_t> center_of) const {
  PacketSearch search(*this, points, min_cosine, center_of);
  if (points.has_normals())
    formats::vectorized<run_with_normals>(search);
  else
    formats::vectorized<run_without_normals>(search);
}

}  // namespace cairn::stages
