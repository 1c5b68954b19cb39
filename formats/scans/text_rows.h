// Rows of a text of numbers: a pass that counts them and learns what their columns hold, and the parse of a
// stretch of them into blocks.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "formats/point_block.h"
#include "formats/scans/text_layout.h"
#include "formats/scans/text_lines.h"

namespace cairn::formats {

/// Rows that are read by one call.
inline constexpr std::uint64_t kStretchRows = 4 * kBlockPoints;
/// A line may have this many fields.
inline constexpr std::size_t kMostTextColumns = 1024;

struct TextStretch {
  std::uint64_t offset = 0;  ///< of the first row, in bytes
  std::uint64_t line = 0;    ///< number of its line
  std::uint64_t rows = 0;    ///< comments, blank lines and counts between them do not count
};

/// What a pass does with the fields of a column.
enum class ColumnUse : std::uint8_t {
  kLeftOut,
  kPosition,  ///< float64 whatever its values
  kLookedAt,  ///< its values tell its type
};

/// Takes in all rows of a scan, one by one, and remembers where its stretches begin.
class RowPass {
 public:
  /// Rows have `uses.size()` fields, at least 3. They are checked up to the last that is looked at.
  RowPass(Separator separator, std::vector<ColumnUse> uses);

  /// Takes in the row where `lines` stands. Throws kInput where a value is missing or no number.
  void add(const LineReader& lines);

  /// Whether a line has as many fields as a row, and all but those left out are numbers.
  bool is_whole_row(std::string_view line) const;

  std::uint64_t rows() const { return rows_; }
  std::vector<TextStretch> stretches() &&;
  const TextColumns& columns() const { return columns_; }

 private:
  void look_for_unit_vectors();

  Separator separator_;
  std::vector<ColumnUse> uses_;
  std::size_t looked_at_ = 0;  ///< columns up to the last looked at
  std::vector<double> row_;
  std::vector<std::size_t> unit_candidates_;
  std::vector<bool> saw_unit_vector_;
  TextColumns columns_;
  std::uint64_t rows_ = 0;
  std::vector<TextStretch> stretches_;
};

/// Throws kInput for a line with another number of fields than `expected`, the last of which may be empty.
[[noreturn]] void refuse_count(const LineReader& lines, Separator separator, std::size_t expected);
/// Throws kInput for a field, counted from 0, that is no number.
[[noreturn]] void refuse_value(const LineReader& lines, std::size_t column, std::string_view field);

/// How the rows of a scan are written.
struct TextRows {
  Separator separator = Separator::kBlanks;
  TextLayout layout;
  bool counts_between = false;  ///< a line of one number is no row
  bool gridded = false;         ///< a row at exactly 0 0 0 is a cell without a point
};

/// Streams the points of a stretch as blocks of this schema and float64 positions. Throws kInput, naming line and
/// offset, for a row with another number of fields or a field that is no number of its column's type.
void read_text_rows(const RandomAccessFile& file, const TextStretch& stretch, const TextRows& rows,
                    const Schema& schema, const std::function<void(const PointBlock&)>& sink);

}  // namespace cairn::formats
