// Gains by which a build has balanced an attribute between scans. They are whole numbers of 2^-16, so that whoever
// knows them gets the same values from the scans, bit by bit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "formats/schema.h"

namespace cairn::formats {

/// One a component, in units of 2^-16.
using Gains = std::vector<std::uint32_t>;
inline constexpr std::uint32_t kUnitGain = 1 << 16;

/// The attribute of records that is balanced.
struct BalancedColumn {
  std::string_view name;
  std::size_t offset = 0;  ///< from the start of a record
  ScalarType type = ScalarType::kU16;
  std::size_t components = 0;  ///< at most 3

  /// Of one component.
  std::uint32_t largest_value() const { return type == ScalarType::kU8 ? UINT8_MAX : UINT16_MAX; }
  std::uint32_t value(const std::byte* record, std::size_t component) const;
};

/// Color, or intensity where there is no color; nothing if these do not have values of 8 or 16 bits. `schema` is that
/// of records that begin with a 12-byte position.
std::optional<BalancedColumn> balanced_column(const Schema& schema);

/// Makes every component c of the records min(largest value, floor((c * gain + 2^15) / 2^16)). Returns in how many
/// records the largest value was too small. Requires a gain for each component.
std::uint64_t apply_gains(std::span<std::byte> records, std::size_t stride,
                          const BalancedColumn& column, const Gains& gains);

}  // namespace cairn::formats
