// What is known of the values of one column of text after a pass over all of them, and the scalar type that
// follows: the same for every order and division of the pass.
#pragma once

#include <cstdint>
#include <string_view>

#include "formats/schema.h"
#include "formats/wide_int.h"

namespace cairn::formats {

class ColumnValues {
 public:
  /// Takes one value in and gives it as a double; false if it is no number.
  bool add(std::string_view field, double& value);

  /// Takes in all that another has seen.
  void add(const ColumnValues& other);

  /// Whether every value is whole, also when written like "117.0", and lies in this range.
  bool are_whole_in(Int128 least, Int128 most) const;

  /// The narrowest integer type that holds every value, unsigned if none is negative; of 64 bits, signed if that
  /// does. Else float32 if no value
  /// has more than the six significant digits that it always gives back, else float64.
  ScalarType narrowest_type() const;

  /// Whether every value has this type: for integers, is whole and in range.
  bool fit(ScalarType type) const;

 private:
  bool add_other(std::string_view field, double& value);
  void add_whole(Int128 value);

  bool whole_ = true;
  bool few_digits_ = true;  ///< of those that are not whole
  Int128 least_ = 0;        ///< of an int64 or a uint64, as is the other
  Int128 most_ = 0;
  bool any_whole_ = false;
};

/// Parses a field as a value of this type as parse_number does, but takes "117.0" for a whole number.
[[nodiscard]] bool parse_field(std::string_view field, ScalarType type, std::byte* to);

}  // namespace cairn::formats
