// The walk through the points of a subtree, in which every leaf point is compared with its representative on every level.
#pragma once

#include <vector>

#include "stages/verify/findings.h"

namespace cairn::stages {

/// What the leaves below a node add to the check of its RMS error.
struct ErrorSum {
  double squares = 0;  ///< world units squared, decoded leaf points to decoded representatives
  double largest_leaf_moved = 0;  ///< world units: largest displacement by quantisation of a leaf
  void add(const ErrorSum& other);
};

/// Compares the RMS error that a node records with the one measured between decoded points. By
/// Minkowski's inequality the two differ by no more than quantisation moved points at both ends.
void check_rms(const formats::DatasetReader& dataset, formats::NodeId node, const ErrorSum& sum,
               Findings& findings);

struct SubtreeResult {
  Findings findings;
  std::vector<ErrorSum>
      above;  ///< for each ancestor of the subtree's root, from the dataset's root down
  std::uint64_t points = 0;  ///< stored points that were checked
  std::uint64_t leaves = 0;
  std::uint64_t digested_leaves = 0;
};

/// Checks all nodes of the subtree below `top`, and those of its ancestors of whose leaves it has the first.
/// Memory: the nodes of one path.
SubtreeResult walk_subtree(const Context& context, const formats::DatasetReader& dataset,
                           formats::NodeId top);

}  // namespace cairn::stages
