#include "formats/scans/ply_layout.h"

namespace cairn::formats {

std::optional<RowLayout> make_ply_layout(const PlyElement& vertex, Schema& schema,
                                         PositionEncoding& encoding) {
  std::vector<RowField> fields;
  std::size_t row_size_bytes = 0;
  for (const PlyProperty& property : vertex.properties) {
    if (property.is_list()) continue;
    fields.push_back({property.name, property.type, row_size_bytes, 1});
    row_size_bytes += size_bytes(property.type);
  }
  return make_row_layout(fields, row_size_bytes, schema, encoding);
}

}  // namespace cairn::formats
