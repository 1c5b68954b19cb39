#include "formats/dataset/metadata_json.h"

#include <nlohmann/json.hpp>
#include <string>

namespace cairn::formats {

using Json = nlohmann::ordered_json;

namespace {

/// What Cairn writes lies in fewer than ten objects and arrays. Far deeper nesting would overflow the stack of whoever
/// walks it.
constexpr int kMostNesting = 64;

struct TooDeep {};

}  // namespace

std::optional<DecodeError> parse_metadata(std::string_view text, Json& json) {
  const auto require_depth = [](int depth, Json::parse_event_t, const Json&) {
    if (depth > kMostNesting) throw TooDeep();
    return true;
  };
  try {
    json = Json::parse(text, require_depth);
    return std::nullopt;
  } catch (const TooDeep&) {
    return DecodeError{"the metadata is nested too deeply", 0, "more levels",
                       std::to_string(kMostNesting) + " at most"};
  } catch (const Json::parse_error& e) {
    return DecodeError{"the metadata is not JSON", e.byte, "something else", "JSON"};
  } catch (const Json::exception&) {
    return DecodeError{"the metadata holds a number beyond all doubles", 0, "an infinite number",
                       "finite numbers"};
  }
}

std::optional<std::uint64_t> number_at(const Json& json,
                                       std::initializer_list<std::string_view> path) {
  const Json* at = &json;
  for (const std::string_view key : path) {
    if (!at->is_object() || !at->contains(key)) return std::nullopt;
    at = &(*at)[key];
  }
  return at->is_number_unsigned() ? std::optional(at->get<std::uint64_t>()) : std::nullopt;
}

}  // namespace cairn::formats
