#include "pipeline/scan_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "formats/error.h"
#include "formats/scans/crs.h"
#include "formats/scans/crs_facts.h"
#include "pipeline/failure.h"
#include "pipeline/human.h"

namespace cairn::pipeline {
namespace {

using formats::AttributeDetails;
using formats::ScanInfo;

/// "a.las", "a.las and b.las", "a.las and 4 more".
std::string names_of(const std::vector<const ScanInfo*>& scans) {
  std::string first = printable(scans.front()->name());
  if (scans.size() == 1) return first;
  if (scans.size() == 2) return first + " and " + printable(scans.back()->name());
  return fmt::format("{} and {} more", first, scans.size() - 1);
}

[[noreturn]] void refuse(const ScanInfo& scan, const ScanInfo& first,
                         const formats::CrsComparison& comparison) {
  throw formats::Error(
      formats::ErrorKind::kInput,
      {.what = fmt::format("the {} of {} is not that of the scans before", comparison.what,
                           printable(scan.name())),
       .path = scan.path,
       .found = printable(comparison.second),
       .expected = fmt::format("{}, as {} has it; --crs names one for all, --mixed-crs takes the "
                               "coordinates as they are",
                               printable(comparison.first), printable(first.name()))});
}

/// Some writers leave a record behind that is empty.
bool tells_crs(const formats::CrsFacts& facts) {
  return facts.code || facts.unit_m || facts.vertical_unit_m || facts.kind ||
         !facts.numbers.empty() || (!facts.name.empty() && facts.name != "unnamed");
}

/// A coordinate system, and the first scan that has it.
struct KnownCrs {
  const ScanInfo* scan = nullptr;
  formats::CrsFacts facts;
};

/// The attribute as the scan has it, if it tells its colors in 16 bits.
bool has_wide_color(const ScanInfo& scan) {
  const auto color = formats::find_attribute(scan.schema, formats::attribute_name::kColor);
  return color && scan.schema[*color].type == formats::ScalarType::kU16;
}

bool keeps_wide_color(const formats::Schema& schema) {
  const auto color = formats::find_attribute(schema, formats::attribute_name::kColor);
  return color && schema[*color].type == formats::ScalarType::kU16;
}

constexpr std::uint16_t kMostByte = 255;

bool looks_narrow(const ScanInfo& scan, const stages::ScanLedger& ledger) {
  return has_wide_color(scan) && ledger.brightest > 0 && ledger.brightest <= kMostByte;
}

/// Whether two ranges have at least half of what they cover together in common.
bool share_half(const std::array<double, 2>& a, const std::array<double, 2>& b) {
  const double common = std::min(a[1], b[1]) - std::max(a[0], b[0]);
  return 2 * common >= std::max(a[1], b[1]) - std::min(a[0], b[0]);
}

const AttributeDetails* details_of(const ScanInfo& scan, const std::string& attribute) {
  const auto at = std::ranges::find(scan.details, attribute, &AttributeDetails::attribute);
  return at == scan.details.end() ? nullptr : &*at;
}

/// Whether values mean the same: the words beside them do not count.
bool same_meaning(const AttributeDetails* a, const AttributeDetails* b) {
  const AttributeDetails none;
  const AttributeDetails& first = a != nullptr ? *a : none;
  const AttributeDetails& second = b != nullptr ? *b : none;
  return first.scale == second.scale && first.offset == second.offset &&
         first.no_data == second.no_data;
}

/// How the scans that have an attribute tell it.
struct Telling {
  const ScanInfo* first = nullptr;            ///< the first scan with the attribute
  const AttributeDetails* details = nullptr;  ///< what it tells
  const ScanInfo* other = nullptr;            ///< the first scan whose values mean something else
  bool same_type = true;                      ///< as the campaign's
};

Telling telling_of(const stages::Scans& scans, const formats::Attribute& attribute) {
  Telling telling;
  for (const auto& scan : scans) {
    const ScanInfo& info = scan->info();
    const auto own = formats::find_attribute(info.schema, attribute.name);
    if (!own) continue;
    telling.same_type = telling.same_type && info.schema[*own].type == attribute.type;
    const AttributeDetails* details = details_of(info, attribute.name);
    if (telling.first == nullptr) {
      telling.first = &info;
      telling.details = details;
    } else if (telling.other == nullptr && !same_meaning(details, telling.details)) {
      telling.other = &info;
    }
  }
  return telling;
}

}  // namespace

void require_one_crs(const stages::Scans& scans) {
  std::vector<const ScanInfo*> without, unlike;
  std::vector<KnownCrs> known;  // distinct ones: scans of a campaign mostly have one
  formats::CrsFacts facts;
  const ScanInfo* before = nullptr;
  for (const auto& scan : scans) {
    const ScanInfo& info = scan->info();
    // Scans of one file have one, which may be long.
    if (before == nullptr || before->crs != info.crs) facts = formats::crs_facts(info.crs);
    before = &info;
    if (!tells_crs(facts)) {
      without.push_back(&info);
      continue;
    }
    // Two that are unknown to a third may contradict each other.
    for (const KnownCrs& other : known) {
      const formats::CrsComparison comparison = formats::compare_crs(other.facts, facts);
      if (comparison.match == formats::CrsMatch::kDifferent) refuse(info, *other.scan, comparison);
    }
    if (!known.empty() && known.front().facts != facts &&
        formats::compare_crs(known.front().facts, facts).match == formats::CrsMatch::kUnknown)
      unlike.push_back(&info);
    if (std::ranges::find(known, facts, &KnownCrs::facts) == known.end())
      known.push_back({&info, facts});
  }
  if (known.empty()) return;
  const ScanInfo* first = known.front().scan;
  const std::string name = printable(formats::crs_name(first->crs));
  if (!without.empty())
    tell_note(fmt::format(
        "{} {} no coordinate system; the coordinates are taken to be in that of {}, {}",
        names_of(without), without.size() == 1 ? "tells" : "tell", printable(first->name()), name));
  if (!unlike.empty())
    tell_note(fmt::format(
        "the coordinate system of {}, {}, is taken for that of {}, {}: they do not tell "
        "enough to be compared",
        names_of(unlike), printable(formats::crs_name(unlike.front()->crs)),
        printable(first->name()), name));
}

unsigned color_bits_of(const stages::Scans& scans, const formats::Schema& schema,
                       const std::vector<stages::ScanLedger>& ledger) {
  if (!keeps_wide_color(schema)) return 0;
  std::uint16_t brightest = 0;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const ScanInfo& info = scans[s]->info();
    if (formats::find_attribute(info.schema, formats::attribute_name::kColor) &&
        !has_wide_color(info))
      return 0;
    brightest = std::max(brightest, ledger[s].brightest);
  }
  return brightest > 0 && brightest <= kMostByte ? 8 : 0;
}

void tell_dark_scans(const stages::Scans& scans, const formats::Schema& schema,
                     const std::vector<stages::ScanLedger>& ledger) {
  if (!keeps_wide_color(schema)) return;
  if (color_bits_of(scans, schema, ledger) > 0) return;
  std::vector<const ScanInfo*> dark;
  for (std::size_t s = 0; s < scans.size(); ++s)
    if (looks_narrow(scans[s]->info(), ledger[s])) dark.push_back(&scans[s]->info());
  if (!dark.empty())
    tell_note(
        fmt::format("no color of {} is above 255, as if of 8 bits in fields of 16; beside the "
                    "others, which are of 16, they are dark",
                    names_of(dark)));
}

void tell_intensity_limits(const stages::Scans& scans, const formats::Schema& schema) {
  constexpr std::string_view kIntensity = formats::attribute_name::kIntensity;
  if (!formats::find_attribute(schema, kIntensity)) return;
  const ScanInfo* first = nullptr;
  std::vector<const ScanInfo*> others;
  for (const auto& scan : scans) {
    const ScanInfo& info = scan->info();
    if (!info.intensity_limits || !formats::find_attribute(info.schema, kIntensity)) continue;
    if (first == nullptr) first = &info;
    if (!share_half(*first->intensity_limits, *info.intensity_limits)) others.push_back(&info);
  }
  if (others.empty()) return;
  const auto shown = [](const ScanInfo& scan) {
    return fmt::format("{} to {}", significant((*scan.intensity_limits)[0], 6),
                       significant((*scan.intensity_limits)[1], 6));
  };
  tell_note(fmt::format(
      "intensities of {} go from {}, those of {} from {}: values are kept as they are stored",
      names_of(others), shown(*others.front()), printable(first->name()), shown(*first)));
}

std::vector<AttributeDetails> common_details(const stages::Scans& scans,
                                             const formats::Schema& schema) {
  std::vector<AttributeDetails> all;
  for (const formats::Attribute& attribute : schema) {
    const Telling telling = telling_of(scans, attribute);
    if (telling.details == nullptr) continue;
    AttributeDetails details = *telling.details;
    if (telling.other != nullptr) details.scale = details.offset = std::nullopt;
    if (telling.other != nullptr || !telling.same_type) details.no_data = std::nullopt;
    all.push_back(std::move(details));
  }
  return all;
}

void tell_lost_details(const stages::Scans& scans, const formats::Schema& schema) {
  for (const formats::Attribute& attribute : schema)
    if (const Telling telling = telling_of(scans, attribute); telling.other != nullptr)
      tell_note(fmt::format(
          "{} has another scale, offset or no-data value in {} than in {}: values are kept "
          "as they are stored, and none of these with them",
          attribute.name, printable(telling.other->name()), printable(telling.first->name())));
}

}  // namespace cairn::pipeline
