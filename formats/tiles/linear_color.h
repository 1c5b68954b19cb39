// Colours as glTF wants them: linear light, where pictures and scanners have sRGB.
// Clients show them again as sRGB (IEC 61966-2-1), but for CesiumJS, which takes a power of 1 / 2.2 for it: there a dark value
// is shown up to 8.5 of 255 brighter than by the standard, so that no stored value of 6 to 21 is shown within 3 by both.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace cairn::formats {

/// Whose pictures the colours are for.
enum class ColorClient : std::uint8_t {
  /// Dark values are stored up to 2.5 of 255 darker than they are: clients that keep to the standard show all within 3, CesiumJS
  /// those from 31 on, and darker ones up to 6 brighter.
  kAny,
  kCesium  ///< CesiumJS shows them as they are; others show dark ones up to 8.5 darker
};

/// "any", "cesiumjs".
const char* name_of(ColorClient client);
std::optional<ColorClient> color_client_named(std::string_view name);

/// From sRGB values of 8 or of 16 bits to linear ones.
class LinearColors {
 public:
  LinearColors(unsigned bits, ColorClient client);

  /// 0 to 65535. Of 16 bits it is the nearest. Of 8 bits it is within 0.45 of 255 on the screen and has as many zeros at its end
  /// as such values have: bright ones then have an empty lower byte, which costs nothing in a stream of bytes (real colours
  /// take a third less). Values beyond the bits count as the largest.
  std::uint16_t of(std::uint16_t value) const {
    return value < table_.size() ? table_[value] : table_.back();
  }

 private:
  std::vector<std::uint16_t> table_;
};

}  // namespace cairn::formats
