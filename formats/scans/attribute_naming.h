// Names for the attributes that a file brings under names of its own.
#pragma once

#include <string>
#include <string_view>

#include "formats/schema.h"

namespace cairn::formats {

/// `raw` as lower_snake_case: ASCII letters and digits are kept, "NormalX" becomes "normal_x",
/// everything else one underscore; at most 64 characters; "attribute" if nothing is left.
std::string sanitised_name(std::string_view raw);

/// What an attribute with a name that has a meaning (see attribute_name) must look like to bear it.
/// Returns false if `candidate` has such a name with another type, and sets its rule if it fits.
bool adopt_meaning(Attribute& candidate);

/// Appends an attribute under the sanitised name of `raw`, with the rule that its meaning asks for.
/// A name that is taken, or that has a meaning which this type does not fit, gets a number:
/// "intensity_2".
void append_attribute(Schema& schema, std::string_view raw, ScalarType type,
                      std::size_t components = 1);

}  // namespace cairn::formats
