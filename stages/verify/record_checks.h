// What can be verified from the index alone: sums of counts, weights and digests, sizes of nodes, nested
// boxes, and what metadata.json repeats.
#pragma once

#include "stages/verify/findings.h"

namespace cairn::stages {

Findings check_records(const formats::DatasetReader& dataset);

}  // namespace cairn::stages
