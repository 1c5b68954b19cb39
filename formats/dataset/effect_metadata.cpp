#include "formats/dataset/effect_metadata.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "formats/dataset/metadata_json.h"
#include "formats/wide_int.h"

namespace cairn::formats {

using Json = nlohmann::ordered_json;

namespace {

constexpr const char* kEffects = "effects";

std::string hex_of(const Digest& digest) {
  char text[33];
  std::snprintf(text, sizeof text, "%016llx%016llx", static_cast<unsigned long long>(digest.high),
                static_cast<unsigned long long>(digest.low));
  return text;
}

std::optional<Digest> digest_of_hex(const std::string& text) {
  if (text.size() != 32) return std::nullopt;
  Digest digest;
  for (const auto& [at, half] : {std::pair{0, &digest.high}, std::pair{16, &digest.low}}) {
    const char* first = text.data() + at;
    const auto [end, error] = std::from_chars(first, first + 16, *half, 16);
    if (error != std::errc{} || end != first + 16) return std::nullopt;
  }
  return digest;
}

std::optional<std::uint32_t> gain_of(const Json& json) {
  if (!json.is_number()) return std::nullopt;
  const double units = json.get<double>() * kUnitGain;
  if (!(units >= 0 && units <= UINT32_MAX) || units != std::floor(units)) return std::nullopt;
  return static_cast<std::uint32_t>(units);
}

DecodeError contradiction(const std::string& what, const Uint128& found, std::uint64_t expected) {
  return {"the metadata contradicts itself: " + what, 0,
          found > UINT64_MAX ? "more than 2^64" : std::to_string(static_cast<std::uint64_t>(found)),
          std::to_string(expected)};
}

}  // namespace

Json effects_json(const MetadataExtras& extras) {
  Json list = Json::array();
  for (const EffectSummary& effect : extras.effects) {
    list.push_back({{"name", effect.name}});
    if (effect.balanced.empty())
      list.back().update({{"removed", effect.removed}, {"digest", hex_of(effect.digest)}});
    else
      list.back()["attribute"] = effect.balanced;
  }
  return list;
}

void add_source_effects(const MetadataExtras& extras, const SourceSummary& source, Json& json) {
  for (std::size_t e = 0; e < extras.effects.size(); ++e)
    if (extras.effects[e].balanced.empty())
      json["dropped"][extras.effects[e].name] = source.removed.at(e);
  if (source.gains.empty()) return;
  Json gains = Json::array();
  for (const std::uint32_t gain : source.gains)
    gains.push_back(static_cast<double>(gain) / kUnitGain);
  json["balance"] = {{"gain", std::move(gains)}, {"clamped", source.clamped}};
}

std::optional<DecodeError> check_effects(const Json& json, const DatasetHeader& header) {
  if (!json.is_object() || !json.contains(kEffects)) return std::nullopt;
  const DecodeError broken{"bad effects in the metadata", 0, "something else", "counts of each"};
  try {
    Uint128 kept = 0, dropped = 0;
    for (const Json& source : json.at("sources")) {
      kept += number_at(source, {"kept"}).value();
      for (const Json& count : source.at("dropped")) dropped += count.get<std::uint64_t>();
    }
    if (kept != header.points) return contradiction("kept of all sources", kept, header.points);
    if (dropped != header.dropped_points)
      return contradiction("dropped of all sources", dropped, header.dropped_points);
    for (const Json& effect : json.at(kEffects)) {
      if (!effect.is_object()) return broken;
      if (!effect.contains("removed")) continue;
      const auto name = effect.at("name").get<std::string>();
      Uint128 removed = 0;
      for (const Json& source : json.at("sources"))
        removed += number_at(source, {"dropped", name}).value();
      const std::uint64_t all = number_at(effect, {"removed"}).value();
      if (removed != all) return contradiction(name + " of all sources", removed, all);
    }
  } catch (const Json::exception&) {
    return broken;
  } catch (const std::bad_optional_access&) {
    return broken;
  }
  return std::nullopt;
}

std::optional<DecodeError> read_metadata_effects(std::string_view text, ToldEffects& effects) {
  effects = {};
  Json json;
  if (auto error = parse_metadata(text, json)) return error;
  if (!json.is_object() || !json.contains(kEffects)) return std::nullopt;
  const DecodeError broken{"bad effects in the metadata", 0, "something else",
                           "counts, digests and gains"};
  try {
    for (const Json& effect : json.at(kEffects)) {
      if (effect.contains("attribute")) {
        effects.balanced = effect.at("attribute").get<std::string>();
        continue;
      }
      const auto removed = number_at(effect, {"removed"});
      const auto digest = digest_of_hex(effect.at("digest").get<std::string>());
      if (!removed || !digest ||
          __builtin_add_overflow(effects.removed, *removed, &effects.removed))
        return broken;
      effects.digest += *digest;
    }
    for (const Json& source : json.at("sources")) {
      effects.sources.push_back({source.at("name").get<std::string>(), {}});
      if (!source.contains("balance")) continue;
      for (const Json& value : source.at("balance").at("gain")) {
        const auto gain = gain_of(value);
        if (!gain) return broken;
        effects.sources.back().gains.push_back(*gain);
      }
    }
  } catch (const Json::exception&) {
    return broken;
  }
  return std::nullopt;
}

std::uint64_t points_before_effects(const DatasetHeader& header, std::string_view metadata) {
  ToldEffects effects;
  return read_metadata_effects(metadata, effects) ? header.points : header.points + effects.removed;
}

}  // namespace cairn::formats
