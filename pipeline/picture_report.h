// What pictures lose, for people and for programs.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "pipeline/picture_measure.h"

namespace cairn::pipeline {

/// A table of a row a picture, and one of means over the views.
std::string pictures_text(const PictureReport& report);

/// {"size": ..., "views": [...], "full": [...], "errors": [...], "means": [...]}. What is infinite or not defined is
/// null, a budget of all points too.
nlohmann::ordered_json pictures_json(const PictureReport& report);

}  // namespace cairn::pipeline
