#include "formats/schema.h"

#include <array>
#include <utility>

namespace cairn::formats {
namespace {

constexpr std::array<std::pair<ScalarType, std::string_view>, 10> kScalarNames{{
    {ScalarType::kU8, "uint8"},
    {ScalarType::kI8, "int8"},
    {ScalarType::kU16, "uint16"},
    {ScalarType::kI16, "int16"},
    {ScalarType::kU32, "uint32"},
    {ScalarType::kI32, "int32"},
    {ScalarType::kU64, "uint64"},
    {ScalarType::kI64, "int64"},
    {ScalarType::kF32, "float32"},
    {ScalarType::kF64, "float64"},
}};

constexpr std::array<std::pair<ReduceRule, std::string_view>, 5> kRuleNames{{
    {ReduceRule::kNone, "none"},
    {ReduceRule::kMean, "mean"},
    {ReduceRule::kNormal, "normal"},
    {ReduceRule::kMajority, "majority"},
    {ReduceRule::kCoverRadius, "cover_radius"},
}};

template <typename Table, typename Value>
std::string_view name_in(const Table& table, Value value) {
  for (const auto& [entry, name] : table)
    if (entry == value) return name;
  return "unknown";
}

}  // namespace

std::size_t size_bytes(ScalarType type) {
  switch (type) {
    case ScalarType::kU8:
    case ScalarType::kI8:
      return 1;
    case ScalarType::kU16:
    case ScalarType::kI16:
      return 2;
    case ScalarType::kU32:
    case ScalarType::kI32:
    case ScalarType::kF32:
      return 4;
    case ScalarType::kU64:
    case ScalarType::kI64:
    case ScalarType::kF64:
      return 8;
  }
  return 0;
}

std::string_view name_of(ScalarType type) { return name_in(kScalarNames, type); }
std::string_view name_of(ReduceRule rule) { return name_in(kRuleNames, rule); }

std::optional<std::size_t> find_attribute(const Schema& schema, std::string_view name) {
  for (std::size_t i = 0; i < schema.size(); ++i)
    if (schema[i].name == name) return i;
  return std::nullopt;
}

RecordLayout::RecordLayout(const Schema& schema, std::size_t position_bytes)
    : position_size_bytes(position_bytes), stride(position_bytes) {
  for (const Attribute& attribute : schema) {
    offsets.push_back(stride);
    stride += attribute.size_bytes();
  }
}

}  // namespace cairn::formats
