// The numerics section of `cairn report`: what arithmetic did to the points, from the scans to the stored levels.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace cairn::pipeline {

/// Taken from a dataset's metadata; null for one that was built before metadata told it. Throws a nlohmann::json exception
/// where the metadata is not as write_metadata makes it.
nlohmann::ordered_json numerics_json(const nlohmann::ordered_json& metadata);

/// As a section of text; empty for null.
std::string numerics_text(const nlohmann::ordered_json& numerics);

}  // namespace cairn::pipeline
