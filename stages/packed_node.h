// How a packed node travels from the pack stage to the index stage, which know nothing of each other.
#pragma once

#include <cstdint>

#include "formats/dataset/node_record.h"
#include "formats/dataset/numerics.h"

namespace cairn::stages {

/// A node whose bytes lie in the spill file. Section offsets count from `spill_offset`.
struct PackedNode {
  formats::NodeRecord record;
  std::uint64_t spill_offset = 0;
  std::uint64_t size_bytes = 0;  ///< of all sections
  formats::Numerics numerics;
};

}  // namespace cairn::stages
