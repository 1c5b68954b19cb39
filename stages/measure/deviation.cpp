#include "stages/measure/deviation.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace cairn::stages {
namespace {

/// Of the 52 bits behind the point of a double, those that tell bins apart are kept.
constexpr int kDroppedBits = 52 - 8;

}  // namespace

void Deviation::add(const Deviation& later) {
  count_ += later.count_;
  squares_ += later.squares_;
  largest_square_ = std::max(largest_square_, later.largest_square_);
}

double Deviation::rms() const {
  return count_ == 0 ? 0 : std::sqrt(squares_ / static_cast<double>(count_));
}

double Deviation::largest() const { return std::sqrt(largest_square_); }

/// The bits of doubles that are not negative order as they do.
std::uint32_t DeviationHistogram::key_of(double square) {
  return static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(square) >> kDroppedBits);
}

std::uint64_t& DeviationHistogram::bin(std::uint32_t key) {
  if (counts_.empty()) first_ = key;
  if (key < first_) {
    counts_.insert(counts_.begin(), first_ - key, 0);
    first_ = key;
  }
  if (key - first_ >= counts_.size()) counts_.resize(key - first_ + 1);
  return counts_[key - first_];
}

void DeviationHistogram::add(const DeviationHistogram& other) {
  for (std::size_t i = 0; i < other.counts_.size(); ++i)
    if (other.counts_[i] > 0) bin(other.first_ + static_cast<std::uint32_t>(i)) += other.counts_[i];
}

double DeviationHistogram::quantile(double share) const {
  std::uint64_t total = 0;
  for (const std::uint64_t count : counts_) total += count;
  if (total == 0) return 0;
  const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(total)));
  std::uint64_t within = 0;
  std::uint64_t key = first_;
  for (const std::uint64_t count : counts_) {
    within += count;
    if (within >= wanted) break;
    ++key;
  }
  // Zero has a bin of its own but for what is too small to be a distance.
  if (key == 0) return 0;
  return std::sqrt(std::bit_cast<double>((key + 1) << kDroppedBits));
}

}  // namespace cairn::stages
