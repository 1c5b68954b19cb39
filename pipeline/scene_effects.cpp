#include "pipeline/scene_effects.h"

#include <fmt/format.h>

#include <array>
#include <limits>

#include "pipeline/scene_shapes.h"
#include "stages/simulate/effects/angular_jitter.h"
#include "stages/simulate/effects/beam_divergence.h"
#include "stages/simulate/effects/dropouts.h"
#include "stages/simulate/effects/dust.h"
#include "stages/simulate/effects/exposure.h"
#include "stages/simulate/effects/foliage.h"
#include "stages/simulate/effects/intensity_falloff.h"
#include "stages/simulate/effects/outliers.h"
#include "stages/simulate/effects/range_noise.h"

namespace cairn::pipeline {
namespace {

using stages::Draws;
using stages::EffectKind;
using stages::Effects;

std::optional<double> number_within(const toml::node& node, double least, double most) {
  const auto value = any_number(node);
  return value && *value >= least && *value <= most ? value : std::nullopt;
}

/// Values of keys that must be there.
double positive(CheckedTable& table, std::string_view key) {
  return table.need(key, "a number above 0", positive_number);
}
double up_to(CheckedTable& table, std::string_view key, double most) {
  return table.need(key, fmt::format("a number from 0 to {}", most),
                    [=](const toml::node& node) { return number_within(node, 0, most); });
}
std::optional<std::uint64_t> whole(CheckedTable& table, std::string_view key, std::uint64_t least,
                                   std::uint64_t most) {
  return table.find(key, fmt::format("a whole number from {} to {}", least, most),
                    [=](const toml::node& node) { return whole_number(node, least, most); });
}
/// One that may be left out, and is 0 then.
double zero_or_more(CheckedTable& table, std::string_view key) {
  return table
      .find(key, "a number of at least 0",
            [](const toml::node& node) {
              return number_within(node, 0, std::numeric_limits<double>::max());
            })
      .value_or(0);
}

void read_registration_error(CheckedTable& table, Effects& effects) {
  effects.registration_error = {.translation = up_to(table, "translation", 1e6),
                                .rotation = up_to(table, "rotation", 90)};
}

void read_moving_objects(CheckedTable& table, Effects& effects) {
  effects.moving_objects = {.scan_time = positive(table, "scan_time")};
}

void read_foliage(CheckedTable& table, Effects& effects) {
  stages::Foliage settings;
  settings.returns =
      static_cast<std::uint32_t>(whole(table, "returns", 1, 15).value_or(settings.returns));
  settings.blocked = table
                         .find("blocked", "a number above 0, at most 1",
                               [](const toml::node& node) {
                                 const auto share = positive_number(node);
                                 return share && *share <= 1 ? share : std::nullopt;
                               })
                         .value_or(settings.blocked);
  effects.of_echoes.push_back({EffectKind::kFoliage, [=](const Draws& draws) {
                                 return stages::make_foliage(settings, draws);
                               }});
}

void read_beam_divergence(CheckedTable& table, Effects& effects) {
  stages::BeamDivergence settings{.divergence = up_to(table, "divergence", 10),
                                  .resolution = positive(table, "resolution")};
  settings.rays = static_cast<unsigned>(whole(table, "rays", 2, 1000).value_or(settings.rays));
  effects.of_echoes.push_back({EffectKind::kBeamDivergence, [=](const Draws&) {
                                 return stages::make_beam_divergence(settings);
                               }});
}

void read_dust(CheckedTable& table, Effects& effects) {
  stages::Dust settings{.mean_free_path = positive(table, "mean_free_path")};
  settings.color = table.find("color", kColor, any_color).value_or(settings.color);
  effects.of_echoes.push_back(
      {EffectKind::kDust, [=](const Draws& draws) { return stages::make_dust(settings, draws); }});
}

void read_dropouts(CheckedTable& table, Effects& effects) {
  const stages::Dropouts settings{.photons = positive(table, "photons"),
                                  .reference_range = positive(table, "reference_range")};
  effects.of_echoes.push_back({EffectKind::kDropouts, [=](const Draws& draws) {
                                 return stages::make_dropouts(settings, draws);
                               }});
}

void read_outliers(CheckedTable& table, Effects& effects) {
  const stages::Outliers settings{.share = up_to(table, "share", 1)};
  effects.of_echoes.push_back({EffectKind::kOutliers, [=](const Draws& draws) {
                                 return stages::make_outliers(settings, draws);
                               }});
}

void read_range_noise(CheckedTable& table, Effects& effects) {
  const stages::RangeNoise settings{.base = positive(table, "base"),
                                    .per_length = zero_or_more(table, "per_length")};
  effects.of_echoes.push_back({EffectKind::kRangeNoise, [=](const Draws& draws) {
                                 return stages::make_range_noise(settings, draws);
                               }});
}

void read_angular_jitter(CheckedTable& table, Effects& effects) {
  const stages::AngularJitter settings{.azimuth = up_to(table, "azimuth", 90),
                                       .elevation = up_to(table, "elevation", 90)};
  effects.of_echoes.push_back({EffectKind::kAngularJitter, [=](const Draws& draws) {
                                 return stages::make_angular_jitter(settings, draws);
                               }});
}

void read_intensity_falloff(CheckedTable& table, Effects& effects) {
  const stages::IntensityFalloff settings{.reference_range = positive(table, "reference_range"),
                                          .attenuation = zero_or_more(table, "attenuation")};
  effects.of_echoes.push_back({EffectKind::kIntensityFalloff, [=](const Draws&) {
                                 return stages::make_intensity_falloff(settings);
                               }});
}

void read_exposure(CheckedTable& table, Effects& effects) {
  const stages::Exposure settings{.exposure = up_to(table, "exposure", 10),
                                  .white_balance = up_to(table, "white_balance", 10)};
  effects.of_echoes.push_back({EffectKind::kExposure, [=](const Draws& draws) {
                                 return stages::make_exposure(settings, draws);
                               }});
}

using ReadEffect = void (*)(CheckedTable& table, Effects& effects);
constexpr auto kReaders = std::to_array<std::pair<EffectKind, ReadEffect>>({
    {EffectKind::kRegistrationError, read_registration_error},
    {EffectKind::kMovingObjects, read_moving_objects},
    {EffectKind::kFoliage, read_foliage},
    {EffectKind::kBeamDivergence, read_beam_divergence},
    {EffectKind::kDust, read_dust},
    {EffectKind::kDropouts, read_dropouts},
    {EffectKind::kOutliers, read_outliers},
    {EffectKind::kRangeNoise, read_range_noise},
    {EffectKind::kAngularJitter, read_angular_jitter},
    {EffectKind::kIntensityFalloff, read_intensity_falloff},
    {EffectKind::kExposure, read_exposure},
});
static_assert(kReaders.size() == stages::kEffects);

}  // namespace

stages::Effects read_effects(const toml::table& effects, const std::filesystem::path& file) {
  CheckedTable table(effects, file, "effects");
  Effects result;
  result.seed = table
                    .find("seed", "a whole number of at least 0",
                          [](const toml::node& node) {
                            return whole_number(node, 0, std::numeric_limits<std::int64_t>::max());
                          })
                    .value_or(result.seed);
  for (const auto& [kind, read] : kReaders) {
    const std::string_view name = stages::kEffectNames[static_cast<std::size_t>(kind)];
    const auto own = table.find(name, fmt::format("a table [effects.{}]", name), any_table);
    if (!own) continue;
    CheckedTable settings(**own, file, fmt::format("effects.{}", name));
    read(settings, result);
    settings.finish();
  }
  table.finish();
  return result;
}

}  // namespace cairn::pipeline
