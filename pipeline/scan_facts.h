// What the scans of a campaign tell beside their points, brought together: coordinate systems, how wide colors are, what
// extra bytes mean. Where they contradict each other it is refused or told.
#pragma once

#include <vector>

#include "formats/dataset/metadata.h"
#include "stages/import/import.h"

namespace cairn::pipeline {

/// Scans whose coordinate systems contradict that of any before (see formats::compare_crs) are refused: Error (kInput). Those that cannot be compared, and those that have none beside some that have, are told in a note.
void require_one_crs(const stages::Scans& scans);

/// 8 if the campaign's colors are of 16 bits and no scan has one above 255, though some that is not black, as LAS files
/// have them whose makers left the upper byte empty; else 0. Colors of scans that have 8 bits are widened, so with
/// these beside them it is 0.
unsigned color_bits_of(const stages::Scans& scans, const formats::Schema& schema,
                       const std::vector<stages::ScanLedger>& ledger);

/// Scans whose colors end at 255 among others that go on: told in a note, as they will look dark beside these.
void tell_dark_scans(const stages::Scans& scans, const formats::Schema& schema,
                     const std::vector<stages::ScanLedger>& ledger);

/// Scans that tell other limits of their intensities than the first which tells any, so that less than half of the range
/// of both is shared: told in a note, as values are kept as they are stored. (Limits are often what a scan happens to hold,
/// so they are never quite the same.)
void tell_intensity_limits(const stages::Scans& scans, const formats::Schema& schema);

/// What LAS files tell of extra bytes of the campaign's schema, where all scans that have an attribute tell the same.
std::vector<formats::AttributeDetails> common_details(const stages::Scans& scans,
                                                      const formats::Schema& schema);

/// Attributes whose scales, offsets or no-data values differ from scan to scan: told in a note, since stored values then
/// mean different things.
void tell_lost_details(const stages::Scans& scans, const formats::Schema& schema);

}  // namespace cairn::pipeline
