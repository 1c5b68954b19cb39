// What a part of the verification found. Parts run side by side, each with its own findings, which are
// then put together in the order of the parts.
#pragma once

#include <string>

#include "stages/verify/verify.h"

namespace cairn::stages {

/// A number as a message shows it.
std::string shown(double value);
std::string shown(std::uint64_t value);
std::string shown(const formats::Digest& digest);
std::string shown(const formats::GridPoint& point);
inline std::string shown(std::string text) { return text; }

class Findings {
 public:
  /// Notes `checks` comparisons of which the worst, or the only one, is `ok` or not.
  template <typename Found, typename Expected>
  void check(Invariant invariant, bool ok, formats::NodeId node, const char* what,
             const Found& found, const Expected& expected, std::uint64_t checks = 1) {
    at(invariant).checks += checks;
    if (!ok) violate(invariant, {node, what, shown(found), shown(expected)});
  }
  /// The same for two values that must be equal.
  template <typename T>
  void equal(Invariant invariant, formats::NodeId node, const char* what, const T& found,
             const T& expected) {
    check(invariant, found == expected, node, what, found, expected);
  }
  void leave_unchecked(Invariant invariant, std::string why) {
    at(invariant).unchecked.push_back(std::move(why));
  }

  /// Puts the findings of a later part behind these.
  void append(Findings&& later);

  std::array<InvariantReport, kInvariants> take() && { return std::move(reports_); }

 private:
  InvariantReport& at(Invariant invariant) { return reports_[static_cast<std::size_t>(invariant)]; }
  void violate(Invariant invariant, Violation violation);

  std::array<InvariantReport, kInvariants> reports_;
};

}  // namespace cairn::stages
