// What metadata.json tells of the effects that a build called for, so that the points of the scans can still be
// accounted for: what was removed is counted by effect and by scan, with a digest, and gains are told exactly.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/dataset/gain.h"
#include "formats/dataset/metadata.h"

namespace cairn::formats {

/// The list `effects` of the metadata.
nlohmann::ordered_json effects_json(const MetadataExtras& extras);
/// Adds what the effects did to one source.
void add_source_effects(const MetadataExtras& extras, const SourceSummary& source,
                        nlohmann::ordered_json& json);

/// Whether counts by effect and by source agree with each other and with the index. Nothing to say of metadata without
/// effects.
[[nodiscard]] std::optional<DecodeError> check_effects(const nlohmann::ordered_json& json,
                                                       const DatasetHeader& header);

/// What of the effects is needed to account for the points of the scans.
struct ToldEffects {
  std::uint64_t removed = 0;  ///< by all effects
  Digest digest;              ///< of the removed records, gains applied
  std::string balanced;       ///< the attribute that has gains; empty: none
  struct Source {
    std::string name;
    Gains gains;  ///< empty: none
  };
  std::vector<Source> sources;
};

/// Of metadata without effects: that nothing was removed or balanced.
[[nodiscard]] std::optional<DecodeError> read_metadata_effects(std::string_view text,
                                                               ToldEffects& effects);

/// Points of the scans that could be kept: those that are, and those that effects removed (0 where the metadata is broken).
std::uint64_t points_before_effects(const DatasetHeader& header, std::string_view metadata);

}  // namespace cairn::formats
