// The order-free digest of input records, by which the points of a dataset can be compared with the
// points of its sources however both are ordered.
#pragma once

#include <cstddef>
#include <span>

#include "formats/dataset/node_record.h"
#include "formats/schema.h"

namespace cairn::formats {

/// Sum modulo 2^128 of the XXH3 128-bit hashes (seed 0) of the records, each `stride` bytes.
/// Requires stride > 0 and records.size() a multiple of it.
Digest digest_of(std::span<const std::byte> records, std::size_t stride);

/// The attributes of a digested record, in order behind the 12-byte grid position: those of the
/// dataset, then the radius if it came with the input.
Schema digest_schema(const DatasetHeader& header);

}  // namespace cairn::formats
