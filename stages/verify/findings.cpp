#include "stages/verify/findings.h"

#include <charconv>

namespace cairn::stages {

std::string shown(double value) {
  char text[32];
  const auto end =
      std::to_chars(text, text + sizeof(text), value).ptr;  // the shortest that reads back the same
  return std::string(text, end);
}

std::string shown(std::uint64_t value) { return std::to_string(value); }

std::string shown(const formats::Digest& digest) {
  std::string text;
  for (const std::uint64_t half : {digest.high, digest.low})
    for (int shift = 60; shift >= 0; shift -= 4) text += "0123456789abcdef"[half >> shift & 15];
  return text;
}

std::string shown(const formats::GridPoint& point) {
  return "(" + std::to_string(point[0]) + ", " + std::to_string(point[1]) + ", " +
         std::to_string(point[2]) + ")";
}

void Findings::violate(Invariant invariant, Violation violation) {
  InvariantReport& report = at(invariant);
  ++report.violations;
  if (report.named.size() < InvariantReport::kNamed) report.named.push_back(std::move(violation));
}

void Findings::append(Findings&& later) {
  for (std::size_t i = 0; i < kInvariants; ++i) {
    InvariantReport& to = reports_[i];
    InvariantReport& from = later.reports_[i];
    to.checks += from.checks;
    to.violations += from.violations;
    for (Violation& violation : from.named)
      if (to.named.size() < InvariantReport::kNamed) to.named.push_back(std::move(violation));
    for (std::string& why : from.unchecked) to.unchecked.push_back(std::move(why));
  }
}

}  // namespace cairn::stages
