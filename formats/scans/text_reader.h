// Reads points from lines of numbers: XYZ, TXT, CSV and PTS. Fields are separated by blanks, tabs, commas or
// semicolons; comments begin with # or //; a line of names, plain or as a comment, may come first, and a line
// with the number of points before each block of them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/random_access_file.h"
#include "formats/scans/scan_reader.h"
#include "formats/scans/text_rows.h"

namespace cairn::formats {

class TextReader : public ScanReader {
 public:
  /// Passes over the whole file once. Throws kInput for a file that does not begin with rows of three or more
  /// numbers or with names that tell x, y and z; for `options.columns` that do not; for a row with another number
  /// of values; and, unless `options.allow_truncated`, for fewer rows than a count promises or a last row cut
  /// off. Where there are more rows than were promised, all are kept and claimed.
  TextReader(const std::filesystem::path& path, const ScanOptions& options);

  std::size_t stretch_count() const override { return stretches_.size(); }
  std::uint64_t stretch_capacity(std::size_t stretch) const override;
  void read(std::size_t stretch, const BlockSink& sink) const override;

 private:
  /// What stands before the first row.
  struct Head {
    std::vector<std::string> names;         ///< of a header line
    std::vector<std::string> comment;       ///< the last comment that names a position
    std::optional<std::uint64_t> count;     ///< of the first block
    std::vector<VariableLengthRecord> crs;  ///< of the first comment that tells one
    bool has_row = false;                   ///< the reader stands on the first row
  };
  std::size_t count_columns(const LineReader& lines, const Head& head, const ScanOptions& options);
  Head read_head(LineReader& lines, const ScanOptions& options) const;
  std::vector<std::string> names_of(const Head& head, std::size_t columns, const LineReader& lines,
                                    const ScanOptions& options) const;
  RowPass count_rows(LineReader& lines, const Head& head, std::vector<ColumnUse> uses,
                     const ScanOptions& options);
  void lay_out(const std::vector<std::string>& names, const TextColumns& columns);

  RandomAccessFile file_;
  bool is_pts_ = false;
  TextRows rows_;
  std::vector<TextStretch> stretches_;
};

/// Whether the beginning of a text is rows of at least three numbers, after any comments and a count.
bool begins_with_rows(std::string_view beginning);

}  // namespace cairn::formats
