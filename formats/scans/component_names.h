// Names for the single numbers of a point, where a format has no attributes of several components: PLY, texts.
#pragma once

#include <string>
#include <vector>

#include "formats/schema.h"

namespace cairn::formats {

/// One number of a point beside its position.
struct NamedComponent {
  std::string name;
  ScalarType type = ScalarType::kU8;
  std::size_t attribute = 0;  ///< index in the schema
  std::size_t component = 0;
};

/// The numbers of a schema in its order: nx, ny, nz; red, green, blue; else the attribute's name, with several
/// components NAME_0, NAME_1, ... What would be an axis, or there twice, gets a number: "x_2".
std::vector<NamedComponent> named_components(const Schema& schema);

}  // namespace cairn::formats
