// The splats nearest to a point by their centers, and how far the point is from what they cover.
#pragma once

#include <array>
#include <limits>
#include <span>

#include "stages/measure/level_search.h"

namespace cairn::stages {

/// Distance, in world units, of a point from a splat: with a normal the disc around its center, else its sphere's
/// inside.
double distance_to(const Splat& splat, const std::array<double, 3>& step,
                   const formats::GridPoint& point);

/// The kNearest sites nearest to the query. Of splats at one position of a node the widest counts. The nearest splat
/// is looked for among these: one whose center is farther than theirs could lie nearer, if it is wide enough.
class NearestSplats final : public SplatSink {
 public:
  static constexpr std::size_t kNearest = 8;
  struct Found {
    double squared_distance;
    Splat splat;
  };

  double rank(double box_squared_distance, double) const override { return box_squared_distance; }
  bool wants(double rank) const override { return rank < reach(); }
  void begin(const SplatNode::RadiusClass& splats) override { splats_ = &splats; }
  double reach() const override {
    return count_ == kNearest ? found_.back().squared_distance
                              : std::numeric_limits<double>::infinity();
  }
  void offer(double squared_distance, std::size_t index) override;

  /// The nearest first.
  std::span<const Found> found() const { return std::span(found_).first(count_); }

 private:
  const SplatNode::RadiusClass* splats_ = nullptr;
  std::array<Found, kNearest> found_;
  std::size_t count_ = 0;
};

/// The nearest site that is not where the query is.
class NearestOther final : public SplatSink {
 public:
  double rank(double box_squared_distance, double) const override { return box_squared_distance; }
  bool wants(double rank) const override { return rank < reach_; }
  void begin(const SplatNode::RadiusClass&) override {}
  double reach() const override { return reach_; }
  void offer(double squared_distance, std::size_t) override {
    if (squared_distance > 0 && squared_distance < reach_) reach_ = squared_distance;
  }

  /// Squared; infinite if there is none.
  double squared_distance() const { return reach_; }

 private:
  double reach_ = std::numeric_limits<double>::infinity();
};

}  // namespace cairn::stages
