// Numbers parted by commas, as flags take places and boxes.
#pragma once

#include <string_view>
#include <vector>

namespace cairn::pipeline {

/// "1,2.5,-3": finite numbers without blanks. Empty for any other text.
std::vector<double> parse_numbers(std::string_view text);

}  // namespace cairn::pipeline
