#include "pipeline/verify_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "pipeline/human.h"

namespace cairn::pipeline {
namespace {

using Json = nlohmann::ordered_json;
using stages::Invariant;
using stages::InvariantReport;

constexpr const char* kPromises[stages::kInvariants] = {
    "every point read is dropped and counted, or kept; weights add up on every level",
    "leaves differ by at most one point; inner nodes are equally full",
    "points lie in their node's box, boxes in their parent's",
    "points lie within the recorded bounds of the points that stand for them",
    "splats, times the recorded factor, cover what they stand for",
};

/// Filled to the width of its column.
std::string state_of(const InvariantReport& invariant, const Paint& paint) {
  if (!invariant.held()) return paint.bad("BROKEN      ");
  if (invariant.checks == 0) return paint.doubtful("not checked ");
  return paint.good("held        ");
}

std::string violation_line(const stages::Violation& v) {
  return fmt::format("      node {}: {}: found {}, expected {}\n", formats::value_of(v.node),
                     printable(v.what), printable(v.found), printable(v.expected));
}

std::string invariant_lines(Invariant name, const InvariantReport& invariant, const Paint& paint) {
  std::string text =
      fmt::format("  {:<13} {} {}\n", stages::name_of(name), state_of(invariant, paint),
                  kPromises[static_cast<std::size_t>(name)]);
  if (!invariant.held())
    text += fmt::format("      {} of {} failed; the first:\n", with_commas(invariant.violations),
                        count_of(invariant.checks, "check"));
  for (const stages::Violation& v : invariant.named) text += violation_line(v);
  for (const std::string& reason : invariant.unchecked)
    text += "      not checked: " + printable(reason) + "\n";
  return text;
}

Json invariant_json(Invariant name, const InvariantReport& invariant) {
  Json violations = Json::array();
  for (const stages::Violation& v : invariant.named)
    violations.push_back({{"node", formats::value_of(v.node)},
                          {"what", v.what},
                          {"found", v.found},
                          {"expected", v.expected}});
  return {{"name", stages::name_of(name)},  {"held", invariant.held()},
          {"checks", invariant.checks},     {"violations", invariant.violations},
          {"first", std::move(violations)}, {"not_checked", invariant.unchecked}};
}

}  // namespace

std::string verify_text(const stages::VerifyReport& report, const std::filesystem::path& folder,
                        const Paint& paint) {
  std::uint64_t checks = 0;
  std::string rows;
  for (std::size_t i = 0; i < stages::kInvariants; ++i) {
    checks += report.invariants[i].checks;
    rows += invariant_lines(static_cast<Invariant>(i), report.invariants[i], paint);
  }
  return fmt::format("{}\n  {}, {}, {} read; {}\n\n{}\n  {}\n", printable(folder.string()),
                     count_of(report.nodes, "node"), count_of(report.points, "stored point"),
                     human_bytes(report.bytes), count_of(checks, "check"), rows,
                     report.held() ? paint.good("Every checked promise holds.")
                                   : paint.bad("The dataset breaks its promises."));
}

std::string verify_json(const stages::VerifyReport& report) {
  Json invariants = Json::array();
  for (std::size_t i = 0; i < stages::kInvariants; ++i)
    invariants.push_back(invariant_json(static_cast<Invariant>(i), report.invariants[i]));
  const Json json{{"held", report.held()},
                  {"nodes", report.nodes},
                  {"points", report.points},
                  {"bytes", report.bytes},
                  {"digested_leaves", report.digested_leaves},
                  {"invariants", std::move(invariants)}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string broken_promises(const stages::VerifyReport& report) {
  std::string names;
  for (std::size_t i = 0; i < stages::kInvariants; ++i)
    if (!report.invariants[i].held())
      names +=
          (names.empty() ? "" : ", ") + std::string(stages::name_of(static_cast<Invariant>(i)));
  return "the dataset breaks what it promises: " + names;
}

}  // namespace cairn::pipeline
