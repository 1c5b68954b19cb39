#include "formats/scans/component_names.h"

#include <array>
#include <set>
#include <string_view>

#include <fmt/format.h>

namespace cairn::formats {
namespace {

bool has_known_parts(const Attribute& attribute) {
  return attribute.components == 3 &&
         (attribute.name == attribute_name::kNormal || attribute.name == attribute_name::kColor);
}

/// The name that readers know a part of an attribute by.
std::string component_name(const Attribute& attribute, std::size_t component) {
  constexpr std::array<std::string_view, 3> kNormal{"nx", "ny", "nz"};
  constexpr std::array<std::string_view, 3> kColor{"red", "green", "blue"};
  if (has_known_parts(attribute))
    return std::string((attribute.name == attribute_name::kNormal ? kNormal : kColor)[component]);
  if (attribute.components == 1) return attribute.name;
  return fmt::format("{}_{}", attribute.name, component);
}

}  // namespace

std::vector<NamedComponent> named_components(const Schema& schema) {
  std::set<std::string> taken{"x", "y", "z"};
  for (const Attribute& attribute : schema)
    for (std::size_t i = 0; has_known_parts(attribute) && i < 3; ++i)
      taken.insert(component_name(attribute, i));
  std::vector<NamedComponent> components;
  for (std::size_t a = 0; a < schema.size(); ++a)
    for (std::size_t c = 0; c < schema[a].components; ++c) {
      const std::string base = component_name(schema[a], c);
      std::string name = base;
      for (int number = 2; !has_known_parts(schema[a]) && !taken.insert(name).second; ++number)
        name = fmt::format("{}_{}", base, number);
      components.push_back({name, schema[a].type, a, c});
    }
  return components;
}

}  // namespace cairn::formats
