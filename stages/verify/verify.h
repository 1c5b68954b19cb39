// Verify: the five invariants of a dataset, proved from its files alone, and against its sources where
// they are at hand. Every section of every node is read, so every checksum is checked on the way.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "stages/context.h"
#include "stages/record_stream.h"

namespace cairn::stages {

enum class Invariant : std::size_t { kConservation, kUniformity, kContainment, kError, kCoverage };
inline constexpr std::size_t kInvariants = 5;
std::string_view name_of(Invariant invariant);

/// One place where a dataset is not what it says.
struct Violation {
  formats::NodeId node{};
  std::string what;
  std::string found;
  std::string expected;
};

/// What was found of one invariant.
struct InvariantReport {
  static constexpr std::size_t kNamed = 8;

  std::uint64_t checks = 0;            ///< comparisons made
  std::uint64_t violations = 0;        ///< of these that failed
  std::vector<Violation> named;        ///< the first kNamed, in order of nodes
  std::vector<std::string> unchecked;  ///< what could not be checked, and why

  bool held() const { return violations == 0; }
};

struct VerifyReport {
  std::array<InvariantReport, kInvariants> invariants;
  std::uint64_t nodes = 0;
  std::uint64_t points = 0;           ///< stored points, all levels
  std::uint64_t bytes = 0;            ///< of all three files
  std::uint64_t digested_leaves = 0;  ///< leaves whose digest was computed anew from their points

  bool held() const;
  const InvariantReport& operator[](Invariant i) const {
    return invariants[static_cast<std::size_t>(i)];
  }
};

/// Checks a dataset. Memory: a path of decoded nodes from the root to a leaf, for each thread. With `sources`, also
/// that their points are as many, with the same digest, as the root's and those that effects have removed together.
/// Throws Error: kInput where bytes are damaged (broken promises are reported, not thrown), kSystem where reading
/// fails.
VerifyReport verify_dataset(const Context& context, const formats::DatasetReader& dataset,
                            const std::optional<RecordSource>& sources);

}  // namespace cairn::stages
