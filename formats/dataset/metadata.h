// metadata.json: a dataset told to people and to other programs. It repeats what the index says and adds
// where the points come from. It holds no time and no path, so the same input gives the same bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/dataset/gain.h"
#include "formats/dataset/grid.h"
#include "formats/dataset/node_record.h"
#include "formats/dataset/numerics.h"
#include "formats/error.h"
#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// One scan and what became of its points.
struct SourceSummary {
  std::string name;    ///< ScanInfo::name
  std::string format;  ///< ScanInfo::format
  std::uint64_t claimed = 0;
  std::uint64_t kept = 0;
  std::uint64_t non_finite = 0;  ///< dropped: a coordinate is no finite number
  std::uint64_t no_return = 0;   ///< dropped: a record without a point
  std::uint64_t missing = 0;
  std::uint64_t uncounted_records = 0;  ///< ScanInfo::uncounted_records
  GridBox box;                          ///< tight box of the kept points; empty if there are none
  double precision =
      0;  ///< world units between neighbouring positions that the scan's numbers can tell
  double largest_rounding =
      0;  ///< world units: how far a position was moved to the dataset's grid, at most
  double rms_rounding = 0;       ///< the same, RMS over the kept points
  std::vector<std::size_t> crs;  ///< the scan's records, as indices into MetadataExtras::crs
  std::vector<std::size_t> replaced_crs;  ///< or into MetadataExtras::replaced_crs
  std::vector<std::uint64_t> removed;     ///< dropped: by each of MetadataExtras::effects
  Gains gains;                ///< by which the points' values were multiplied; empty: not at all
  std::uint64_t clamped = 0;  ///< kept points of which a value became too large for its type
};

/// An effect that the build called for, and what it did to all sources together.
struct EffectSummary {
  std::string name;
  std::uint64_t removed = 0;
  Digest digest;         ///< of the removed records, gains applied
  std::string balanced;  ///< the attribute that it gave gains; empty: it removes points
};

/// What the metadata holds that the index does not.
struct MetadataExtras {
  /// Settings that decide the bytes of the dataset, in the order to be told; values are JSON texts
  /// (`15`, `"lzo"`, `null`). Not threads, memory or paths.
  std::vector<std::pair<std::string, std::string>> parameters;
  std::vector<SourceSummary> sources;
  std::vector<VariableLengthRecord> crs;  ///< as the inputs have them, each once
  /// Those of the inputs, where `crs` is what the user says instead.
  std::vector<VariableLengthRecord> replaced_crs;
  std::vector<Numerics> levels;           ///< coarse to fine
  std::vector<EffectSummary> effects;     ///< in the order in which they acted
  std::vector<AttributeDetails> details;  ///< at most one an attribute
  /// Of `color`, if no value needs more bits than this, fewer than its type has; 0: it does.
  unsigned color_bits = 0;
};

/// The text of metadata.json. `nodes` are all records, in id order, with final section offsets. Throws
/// Error (kUsage) where a parameter is not JSON.
std::string write_metadata(const DatasetHeader& header, const std::vector<NodeRecord>& nodes,
                           const MetadataExtras& extras);

/// Whether the text is a JSON object, nested at most 64 deep, without numbers that no double holds. What it says is not
/// checked.
[[nodiscard]] std::optional<DecodeError> check_metadata_text(std::string_view text);

/// Compares what metadata.json repeats of the index (points and how many were read, dropped, missing, the
/// counts by effect; the tree) with the index. Offsets of errors are known for broken JSON only.
[[nodiscard]] std::optional<DecodeError> check_metadata(std::string_view text,
                                                        const DatasetHeader& header);

/// Bits that the values of the attribute `color` need, where metadata says that these are fewer than its type has.
std::optional<unsigned> read_metadata_color_bits(std::string_view text);

/// What metadata tells of attributes that were extra bytes of LAS files. Of what cannot be such there is none.
std::vector<AttributeDetails> read_metadata_details(std::string_view text);

/// Of the records that read_metadata_crs gives for the text those that one file is to carry: where sources brought them,
/// those of the first source that has some, else all. Sources may tell one system in several ways, or each its own.
std::vector<VariableLengthRecord> records_of_one_crs(std::string_view text,
                                                     const std::vector<VariableLengthRecord>& crs);

/// The coordinate system records that a metadata text carries. Empty if there are none.
[[nodiscard]] std::optional<DecodeError> read_metadata_crs(std::string_view text,
                                                           std::vector<VariableLengthRecord>& crs);

}  // namespace cairn::formats
