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
/// The same of the first `digested_bytes` of each record. Requires digested_bytes <= stride.
Digest digest_of(std::span<const std::byte> records, std::size_t stride,
                 std::size_t digested_bytes);

/// The attributes of a digested record, in order behind the 12-byte grid position: those of the
/// dataset that the input brings, then the radius if it came with the input.
Schema digest_schema(const DatasetHeader& header);

/// The attributes of a record as the stages hand it on, behind the 12-byte grid position: those that are
/// digested, then the estimated ones, then the radius if it is estimated from neighbours.
Schema record_schema(const DatasetHeader& header);

}  // namespace cairn::formats
