// How metadata.json tells what LAS files say of their extra bytes.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// The object under "las" of an attribute of this type.
nlohmann::ordered_json details_json(const AttributeDetails& details, ScalarType type);

}  // namespace cairn::formats
