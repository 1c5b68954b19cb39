// Which columns of a text become the position and which become attributes.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/scans/column_values.h"
#include "formats/scans/text_lines.h"
#include "formats/schema.h"

namespace cairn::formats {

struct TextLayout {
  enum class Role : std::uint8_t { kLeftOut, kPosition, kAttribute };
  struct Column {
    Role role = Role::kLeftOut;
    std::size_t component = 0;  ///< of the attribute, or axis of the position
    std::size_t attribute = 0;  ///< index in the schema
    ScalarType type = ScalarType::kF64;
  };
  std::vector<Column> columns;  ///< of a line, in order
};

/// The name of a column that is left out.
inline constexpr std::string_view kLeftOutColumn = "_";

/// The columns of these names that are the position: for each axis the first. Nothing if one is missing.
std::optional<std::array<std::size_t, 3>> find_position(const std::vector<std::string>& names);

/// What a pass over all rows has found out about them.
struct TextColumns {
  std::vector<ColumnValues> values;  ///< of each column; of those that are no position or left out
  /// For each column whether it and the two behind it are unit vectors or zero in every row.
  std::vector<bool> begins_unit_vector;
};

/// Names for the columns of a text that has none. After x, y and z, three columns of whole numbers from 0 to
/// 255 are red, green, blue, and three that are unit vectors nx, ny, nz; a single column, and in the order of PTS
/// (`intensity_first`) the first one, is intensity. All others are column_4, column_5, ... by their place.
std::vector<std::string> recognise_columns(const TextColumns& columns, bool intensity_first);

/// Lays out the columns of these names. nx, ny, nz become `normal` (float32), red, green, blue whole numbers of up
/// to 16 bits `color`; every other column gets the type that its meaning asks for, else the narrowest that holds
/// its values. Fills `schema`. Returns nothing if x, y or z is missing.
std::optional<TextLayout> make_text_layout(const std::vector<std::string>& names,
                                           const TextColumns& columns, Schema& schema);

}  // namespace cairn::formats
