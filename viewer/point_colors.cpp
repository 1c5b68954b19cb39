#include "viewer/point_colors.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "formats/scalar_value.h"

namespace cairn::viewer {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

std::uint32_t pack(const Rgb& rgb) { return pack_color(rgb[0], rgb[1], rgb[2]); }

}  // namespace

std::uint32_t pack_color(std::uint32_t red, std::uint32_t green, std::uint32_t blue) {
  return red | green << 8 | blue << 16 | 0xff000000u;
}

std::uint32_t ramp_color(double share) {
  // Nine equally spaced values of viridis, joined by lines.
  static constexpr std::array<Rgb, 9> kStops{{{68, 1, 84},
                                              {71, 44, 122},
                                              {59, 81, 139},
                                              {44, 113, 142},
                                              {33, 144, 141},
                                              {39, 173, 129},
                                              {92, 200, 99},
                                              {170, 220, 50},
                                              {253, 231, 37}}};
  const double at = std::clamp(std::isnan(share) ? 0.0 : share, 0.0, 1.0) * (kStops.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double rest = at - static_cast<double>(below);
  Rgb rgb{};
  for (std::size_t i = 0; i < rgb.size(); ++i)
    rgb[i] = static_cast<std::uint8_t>(
        std::lround(kStops[below][i] + rest * (kStops[below + 1][i] - kStops[below][i])));
  return pack(rgb);
}

std::uint32_t palette_color(std::uint32_t index) {
  // Okabe, Ito 2008: told apart by color-blind people too.
  static constexpr std::array<Rgb, 7> kColors{{{230, 159, 0},
                                               {86, 180, 233},
                                               {0, 158, 115},
                                               {240, 228, 66},
                                               {0, 114, 178},
                                               {213, 94, 0},
                                               {204, 121, 167}}};
  return pack(kColors[index % kColors.size()]);
}

std::uint32_t class_color(std::uint32_t classification) {
  static constexpr std::array<Rgb, 19> kClasses{{
      {150, 150, 150},  // never classified
      {190, 190, 190},  // unassigned
      {153, 102, 51},   // ground
      {163, 209, 102},  // low vegetation
      {92, 168, 62},    // medium vegetation
      {28, 107, 42},    // high vegetation
      {226, 92, 60},    // building
      {255, 0, 255},    // low point, noise
      {120, 200, 220},  // model key point
      {52, 120, 220},   // water
      {130, 110, 160},  // rail
      {90, 90, 100},    // road surface
      {230, 230, 120},  // overlap
      {250, 220, 80},   // wire, guard
      {250, 180, 40},   // wire, conductor
      {200, 120, 60},   // transmission tower
      {160, 160, 220},  // wire structure connector
      {180, 150, 130},  // bridge deck
      {255, 60, 180},   // high noise
  }};
  return classification < kClasses.size() ? pack(kClasses[classification])
                                          : palette_color(classification);
}

ValueRange middle_range(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return {};
  const auto at = [&](double share) {
    const auto index = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + index, values.end());
    return values[static_cast<std::size_t>(index)];
  };
  const ValueRange range{at(0.01), at(0.99)};
  return range.greatest > range.least ? range : ValueRange{range.least, range.least + 1};
}

std::vector<double> column_values(std::span<const std::byte> column,
                                  const formats::Attribute& attribute) {
  std::vector<double> values(column.size() / attribute.size_bytes());
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = formats::load_scalar(column.data() + i * attribute.size_bytes(), attribute.type);
  return values;
}

namespace {

/// Calls visit(point, component, value) for all of a column of u8 or u16.
template <typename Visit>
void for_each_component(std::span<const std::byte> column, const formats::Attribute& attribute,
                        const Visit& visit) {
  const bool wide = attribute.type == formats::ScalarType::kU16;
  const std::size_t count = column.size() / attribute.size_bytes();
  for (std::size_t point = 0, at = 0; point < count; ++point)
    for (std::size_t component = 0; component < attribute.components; ++component) {
      visit(point, component,
            wide ? formats::load_le<std::uint16_t>(&column[at])
                 : static_cast<std::uint16_t>(column[at]));
      at += wide ? 2 : 1;
    }
}

}  // namespace

unsigned color_bits(std::span<const std::byte> column, const formats::Attribute& attribute) {
  std::uint16_t brightest = 0;
  for_each_component(column, attribute, [&](std::size_t, std::size_t, std::uint16_t value) {
    brightest = std::max(brightest, value);
  });
  return brightest > 255 ? 16 : 8;
}

void convert_colors(std::span<const std::byte> column, const formats::Attribute& attribute,
                    unsigned bits, std::vector<std::uint32_t>& colors) {
  const unsigned shift = bits - 8;
  colors.assign(column.size() / attribute.size_bytes(), pack_color(0, 0, 0));
  for_each_component(column, attribute,
                     [&](std::size_t point, std::size_t component, std::uint16_t value) {
                       const std::uint32_t byte = std::min<std::uint32_t>(value >> shift, 255);
                       colors[point] |= byte << (8 * component);
                     });
}

}  // namespace cairn::viewer
