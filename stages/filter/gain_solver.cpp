#include "stages/filter/gain_solver.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace cairn::stages {

namespace {

/// Weights and weighted ratios are whole numbers of this.
constexpr double kUnit = 1.0 / (1 << 20);

}  // namespace

void Overlap::add(double log_ratio, double weight) {
  weight_ += std::llround(weight / kUnit);
  log_ratio_ += static_cast<formats::Int128>(std::floor(weight * log_ratio / kUnit + 0.5));
}

void Overlap::add(const Overlap& other) {
  weight_ += other.weight_;
  log_ratio_ += other.log_ratio_;
}

double Overlap::weight() const { return static_cast<double>(weight_) * kUnit; }
double Overlap::weighted_log_ratio() const { return static_cast<double>(log_ratio_) * kUnit; }

std::vector<double> solve_log_gains(const Overlaps& overlaps, std::size_t scans) {
  const auto n = static_cast<Eigen::Index>(scans);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  for (const auto& [pair, overlap] : overlaps) {
    const Eigen::Index i = pair.first, j = pair.second;
    normal(i, i) += overlap.weight();
    normal(j, j) += overlap.weight();
    normal(i, j) -= overlap.weight();
    normal(j, i) -= overlap.weight();
    right(i) -= overlap.weighted_log_ratio();
    right(j) += overlap.weighted_log_ratio();
  }
  const Eigen::VectorXd gains = normal.ldlt().solve(right);
  return {gains.begin(), gains.end()};
}

}  // namespace cairn::stages
