// What a build refuses before it begins the work that it would be in vain for, and what it tells of scans that it takes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "formats/dataset/tree.h"
#include "formats/schema.h"
#include "pipeline/build_options.h"
#include "pipeline/journal.h"
#include "pipeline/workspace.h"
#include "stages/import/import.h"

namespace cairn::pipeline {

/// What the scans bring is not silently replaced. Throws Error (kUsage).
void require_room_for_estimates(const BuildOptions& options, const formats::Schema& schema);

/// Points can only be fewer than the headers claim, and packed nodes have not been seen to be larger than their records: what
/// is asked for is an upper bound of what the stages that are not done yet take. `numbered`: points hold the number
/// of their scan. Throws Error (kSystem) with needed and free bytes.
void require_disk(const Workspace& workspace, const Journal& journal, const BuildOptions& options,
                  const stages::CampaignSize& size, bool numbered);

/// A node that does not fit the memory is refused before its points are sorted into it. `stride`: bytes of a record.
/// Throws Error (kUsage) with the least memory that suffices.
void require_node_memory(const formats::Tree& tree, std::size_t stride, std::uint64_t memory_bytes);

/// Floating-point coordinates far from their origin may have lost detail before they came here: told where they tell apart
/// fewer than 2^16 places along the scan's longest side.
void tell_lost_detail(const stages::Scans& scans, const stages::ImportedPoints& imported);

/// What a file holds beyond what its header counts is not read, but not passed over in silence.
void tell_uncounted_records(const stages::Scans& scans);

}  // namespace cairn::pipeline
