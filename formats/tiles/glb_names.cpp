#include "formats/tiles/glb_names.h"

#include <algorithm>
#include <array>

#include "formats/error.h"

namespace cairn::formats {
namespace {

struct ComponentType {
  ScalarType type;
  int number;
  const char* property_type;
};
constexpr std::array<ComponentType, 5> kTypes{{{ScalarType::kI8, 5120, "INT8"},
                                               {ScalarType::kU8, 5121, "UINT8"},
                                               {ScalarType::kI16, 5122, "INT16"},
                                               {ScalarType::kU16, 5123, "UINT16"},
                                               {ScalarType::kF32, 5126, "FLOAT32"}}};

const ComponentType& entry_of(ScalarType type) {
  const auto* const at = std::ranges::find(kTypes, type, &ComponentType::type);
  CAIRN_CHECK(at != kTypes.end());
  return *at;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::string semantic_of(std::string_view attribute) {
  std::string semantic = "_";
  for (const char c : attribute)
    semantic += c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return semantic;
}

std::string property_of(std::string_view semantic) {
  const bool keeps_mark = semantic.size() < 2 || is_digit(semantic[1]);
  std::string property;
  for (const char c : semantic.substr(keeps_mark ? 0 : 1))
    property += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return property;
}

int component_type_of(ScalarType type) { return entry_of(type).number; }

std::optional<ScalarType> scalar_type_of(std::int64_t component_type) {
  for (const ComponentType& entry : kTypes)
    if (entry.number == component_type) return entry.type;
  return std::nullopt;
}

const char* property_type_of(ScalarType type) { return entry_of(type).property_type; }

}  // namespace cairn::formats
