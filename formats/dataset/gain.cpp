#include "formats/dataset/gain.h"

#include <algorithm>

#include "formats/bytes.h"
#include "formats/error.h"

namespace cairn::formats {

std::uint32_t BalancedColumn::value(const std::byte* record, std::size_t component) const {
  const std::byte* at = record + offset;
  return type == ScalarType::kU8 ? load_le<std::uint8_t>(at + component)
                                 : load_le<std::uint16_t>(at + 2 * component);
}

std::optional<BalancedColumn> balanced_column(const Schema& schema) {
  const auto color = find_attribute(schema, attribute_name::kColor);
  const std::string_view name = color ? attribute_name::kColor : attribute_name::kIntensity;
  const std::size_t components = color ? 3 : 1;
  const auto found = find_attribute(schema, name);
  if (!found) return std::nullopt;
  const Attribute& attribute = schema[*found];
  if (attribute.type != ScalarType::kU8 && attribute.type != ScalarType::kU16) return std::nullopt;
  if (attribute.components != components) return std::nullopt;
  return BalancedColumn{name, RecordLayout(schema, 12).offsets[*found], attribute.type, components};
}

std::uint64_t apply_gains(std::span<std::byte> records, std::size_t stride,
                          const BalancedColumn& column, const Gains& gains) {
  CAIRN_CHECK(gains.size() == column.components);
  const std::uint64_t most = column.largest_value();
  std::uint64_t clamped = 0;
  for (std::size_t record = 0; record < records.size(); record += stride) {
    bool too_large = false;
    for (std::size_t c = 0; c < column.components; ++c) {
      const std::uint64_t value = column.value(records.data() + record, c);
      const std::uint64_t gained = (value * gains[c] + kUnitGain / 2) / kUnitGain;
      too_large = too_large || gained > most;
      std::byte* at = records.data() + record + column.offset;
      if (column.type == ScalarType::kU8)
        store_le(at + c, static_cast<std::uint8_t>(std::min(gained, most)));
      else
        store_le(at + 2 * c, static_cast<std::uint16_t>(std::min(gained, most)));
    }
    clamped += too_large ? 1 : 0;
  }
  return clamped;
}

}  // namespace cairn::formats
