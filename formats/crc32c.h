// CRC-32C, the checksum of the pages of E57 files.
// Based on: G. Castagnoli, S. Braeuer, M. Herrmann, "Optimization of Cyclic Redundancy-Check Codes with 24 and 32 Parity
// Bits", 1993 (the polynomial); M. Kounavis, F. Berry, "A Systematic Approach to Building High Performance Software-based
// CRC Generators", 2005 (eight tables).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace cairn::formats {

/// The checksum of `bytes`, by the processor's instruction where it has one (SSE 4.2).
std::uint32_t crc32c(std::span<const std::byte> bytes);

/// The same by tables, on any processor.
std::uint32_t crc32c_by_tables(std::span<const std::byte> bytes);

}  // namespace cairn::formats
