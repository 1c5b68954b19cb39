#include "formats/scans/attribute_naming.h"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "formats/error.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kMaxNameLength = 64;

bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

struct Meaning {
  std::string_view name;
  std::optional<ScalarType> type;  ///< none: any
  std::optional<ScalarType> other_type;
  std::size_t components;
  ReduceRule rule;
};

constexpr std::array<Meaning, 16> kMeanings{{
    {attribute_name::kNormal, ScalarType::kF32, ScalarType::kF64, 3, ReduceRule::kNormal},
    {attribute_name::kRadius, ScalarType::kF32, {}, 1, ReduceRule::kCoverRadius},
    {attribute_name::kColor, ScalarType::kU8, ScalarType::kU16, 3, ReduceRule::kMean},
    {attribute_name::kNearInfrared, ScalarType::kU16, {}, 1, ReduceRule::kMean},
    {attribute_name::kIntensity, {}, {}, 1, ReduceRule::kMean},
    {attribute_name::kClassification, ScalarType::kU8, {}, 1, ReduceRule::kMajority},
    {attribute_name::kReturnNumber, ScalarType::kU8, {}, 1, ReduceRule::kNone},
    {attribute_name::kReturnCount, ScalarType::kU8, {}, 1, ReduceRule::kNone},
    {attribute_name::kScanFlags, ScalarType::kU8, {}, 1, ReduceRule::kNone},
    {attribute_name::kClassFlags, ScalarType::kU8, {}, 1, ReduceRule::kNone},
    {attribute_name::kUserData, ScalarType::kU8, {}, 1, ReduceRule::kNone},
    {attribute_name::kScanAngleRank, ScalarType::kI8, {}, 1, ReduceRule::kNone},
    {attribute_name::kScanAngle, ScalarType::kI16, {}, 1, ReduceRule::kNone},
    {attribute_name::kPointSourceId, ScalarType::kU16, {}, 1, ReduceRule::kNone},
    {attribute_name::kGpsTime, ScalarType::kF64, {}, 1, ReduceRule::kNone},
    {attribute_name::kWaveform, ScalarType::kU8, {}, 29, ReduceRule::kNone},
}};

/// The number of `name` if it is `base`, an underscore and a number, else 0.
std::size_t number_of(std::string_view name, std::string_view base) {
  if (!name.starts_with(base) || name.size() < base.size() + 2 || name[base.size()] != '_')
    return 0;
  const std::string_view digits = name.substr(base.size() + 1);
  constexpr std::size_t kMaxDigits = 9;
  if (digits.size() > kMaxDigits || !std::all_of(digits.begin(), digits.end(), is_digit)) return 0;
  return static_cast<std::size_t>(std::stoul(std::string(digits)));
}

/// The smallest number from 2 on that is not in use for `base`. Found in one pass: trying one name after the
/// other takes cubic time on a file that names everything alike. As many numbers as there are attributes,
/// and one more, cannot all be in use.
std::size_t free_number(const Schema& schema, std::string_view base) {
  constexpr std::size_t kFirst = 2;
  std::vector<bool> used(schema.size() + 1);
  for (const Attribute& attribute : schema) {
    const std::size_t number = number_of(attribute.name, base);
    if (number >= kFirst && number - kFirst < used.size()) used[number - kFirst] = true;
  }
  return kFirst +
         static_cast<std::size_t>(std::find(used.begin(), used.end(), false) - used.begin());
}

}  // namespace

std::string sanitised_name(std::string_view raw) {
  std::string name;
  char previous = 0;
  for (const char c : raw) {
    if (name.size() >= kMaxNameLength) break;
    if (is_upper(c)) {
      if (is_lower(previous)) name += '_';
      name += static_cast<char>(c - 'A' + 'a');
    } else if (is_lower(c) || is_digit(c)) {
      name += c;
    } else if (!name.empty() && name.back() != '_') {
      name += '_';
    }
    previous = c;
  }
  while (name.ends_with('_')) name.pop_back();
  return name.empty() ? "attribute" : name;
}

bool adopt_meaning(Attribute& candidate) {
  for (const Meaning& meaning : kMeanings) {
    if (meaning.name != candidate.name) continue;
    const bool type_fits =
        !meaning.type || candidate.type == *meaning.type || candidate.type == meaning.other_type;
    if (!type_fits || candidate.components != meaning.components) return false;
    candidate.rule = meaning.rule;
  }
  return true;
}

void append_attribute(Schema& schema, std::string_view raw, ScalarType type,
                      std::size_t components) {
  CAIRN_CHECK(components >= 1 && components <= 255);
  const std::string base = sanitised_name(raw);
  Attribute attribute{
      .name = base, .type = type, .components = static_cast<std::uint8_t>(components)};
  if (find_attribute(schema, base) || !adopt_meaning(attribute))
    attribute.name = base + "_" + std::to_string(free_number(schema, base));
  schema.push_back(std::move(attribute));
}

}  // namespace cairn::formats
