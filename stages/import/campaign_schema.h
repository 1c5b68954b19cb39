// One schema for a campaign whose scans bring different attributes, and the conversion of a scan's
// columns into the campaign's point records.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "formats/point_block.h"
#include "formats/scans/scan_reader.h"
#include "formats/schema.h"

namespace cairn::stages {

/// The union of the scans' attributes in order of first appearance, the radius last, those named in `drop` left out
/// and, if `keep` is not empty, all others than those named there. Where types differ the narrowest type that holds
/// both is taken (8-bit colours are widened by 257, see RecordConverter). A scan without an attribute has zeros
/// there. Throws Error (kInput) where the component counts of an attribute that stays differ or more than
/// formats::kMaxAttributes stay, and Error (kUsage) if `drop` or `keep` names an attribute no scan has.
formats::Schema merge_schemas(std::span<const formats::ScanInfo* const> scans,
                              const std::vector<std::string>& drop,
                              const std::vector<std::string>& keep = {});

/// Whether colours whose width only their values tell are of 16 bits: if those of one such scan are, all are.
bool guessed_colors_are_wide(std::span<const formats::ScanInfo* const> scans);

/// Writes blocks of one scan as records of the campaign's layout: position in the scan's own encoding,
/// then the attributes. Radii that are none (negative, infinite, no numbers) become 0. Stateless; used by
/// several threads.
class RecordConverter {
 public:
  /// `layout` must outlive the converter. 8-bit colours are widened to 16 bits unless they are guessed to be of 8
  /// bits and `guessed_colors_are_wide`: then they have 16 as they are. Throws Error (kInput), naming scan and
  /// attribute, where the scan's attribute has other components than the campaign's or values that its type cannot
  /// hold.
  RecordConverter(const formats::ScanInfo& scan, const formats::Schema& campaign,
                  const formats::RecordLayout& layout, bool guessed_colors_are_wide);

  /// Writes the block's points with finite coordinates to `out`, which has room for block.count records
  /// and reads as zeros where the scan lacks an attribute. Returns how many were written.
  std::size_t convert(const formats::PointBlock& block, std::byte* out) const;

 private:
  struct Column {
    std::size_t source;  ///< index in the scan's schema
    std::size_t offset;  ///< in the record
    formats::Attribute from;
    formats::Attribute to;
    double factor;  ///< 257 where an 8-bit colour is widened, else 1
  };

  void copy_column(const Column& column, const formats::PointBlock& block,
                   std::span<const std::uint32_t> kept, std::byte* out) const;

  const formats::RecordLayout& layout_;
  formats::PositionEncoding encoding_;
  std::vector<Column> columns_;
};

}  // namespace cairn::stages
