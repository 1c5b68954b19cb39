// A subtree's share of its parent (WorkingNode) to and from the bytes by which a job that was interrupted goes on.
#pragma once

#include "stages/cluster/working_node.h"
#include "stages/unit_state.h"

namespace cairn::stages {

void put_share(StateWriter& state, const WorkingNode& share);
WorkingNode get_share(StateReader& state);

}  // namespace cairn::stages
