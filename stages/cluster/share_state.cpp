#include "stages/cluster/share_state.h"

namespace cairn::stages {
namespace {

/// Calls `visit` with each member, so that both directions follow one list.
template <typename Node, typename Visit>
void visit_members(Node& node, Visit visit) {
  visit(node.data.position);
  visit(node.data.representative);
  visit(node.data.weight);
  visit(node.data.radius);
  for (auto& column : node.data.attributes) visit(column);
  visit(node.normal);
  visit(node.residual);
  visit(node.bound);
  visit(node.reach);
  visit(node.normal_sum);
  for (auto& sums : node.mean_sum) visit(sums);
  visit(node.squared_steps);
  visit(node.box);
  visit(node.weight);
  visit(node.digest);
  visit(node.theta);
  visit(node.grid);
  visit(node.numerics);
}

}  // namespace

void put_share(StateWriter& state, const WorkingNode& share) {
  state.put(std::uint64_t{share.data.attributes.size()}).put(std::uint64_t{share.mean_sum.size()});
  visit_members(share, [&](const auto& member) { state.put(member); });
}

WorkingNode get_share(StateReader& state) {
  WorkingNode share;
  std::uint64_t attributes = 0, sums = 0;
  state.get(attributes);
  state.get(sums);
  share.data.attributes.resize(attributes);
  share.mean_sum.resize(sums);
  visit_members(share, [&](auto& member) { state.get(member); });
  return share;
}

}  // namespace cairn::stages
