// Lines of a text of numbers, and the fields of a line: what all text formats share. Lines end with "\n" or
// "\r\n"; blank lines and comments ("#" or "//") are passed over.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "formats/buffered_reader.h"

namespace cairn::formats {

/// What parts the fields of a line. Blanks and tabs around a comma or semicolon are padding.
enum class Separator { kBlanks, kCommas, kSemicolons };

/// Semicolons win over commas, so that "1,5;2,5" is two damaged numbers instead of four whole ones.
Separator separator_of(std::string_view line);

/// Takes the next field off the front of `line`; false at its end. One separator may end a line.
bool next_field(std::string_view& line, Separator separator, std::string_view& field);

bool has_one_field(std::string_view line, Separator separator);
std::size_t count_fields(std::string_view line, Separator separator);

/// Whether a comma or semicolon ends the line: nothing, or a last field that is empty.
bool ends_with_empty_field(std::string_view line, Separator separator);

/// A comment without its mark and the blanks around it. `line` is a comment if it begins with a mark.
bool is_comment(std::string_view line);
std::string_view comment_text(std::string_view line);

/// Reads the lines that hold something, knowing number and offset of each for messages.
class LineReader {
 public:
  /// Begins at byte `offset`, the start of line `number` (from 1). `file` must outlive the reader.
  explicit LineReader(const RandomAccessFile& file, std::uint64_t offset = 0,
                      std::uint64_t number = 1);

  /// Moves to the next line that is neither blank nor a comment; false at the end of the file. Throws kInput for a
  /// "\r" between the characters of a line.
  bool next();
  /// As above, but stops at comments too.
  bool next_or_comment();

  std::string_view line() const { return line_; }   ///< valid until the next call
  std::uint64_t number() const { return number_; }  ///< of the line
  std::uint64_t offset() const { return offset_; }  ///< of its first byte
  bool was_ended() const { return reader_.line_was_ended(); }

  /// Throws kInput, naming the line.
  [[noreturn]] void refuse(std::string_view what, std::string_view found,
                           std::string expected) const;

 private:
  const RandomAccessFile& file_;
  BufferedReader reader_;
  std::string_view line_;
  std::uint64_t next_number_;
  std::uint64_t number_ = 0;
  std::uint64_t offset_ = 0;
};

/// 3 if the file begins with the mark of UTF-8, else 0.
std::uint64_t text_start(const RandomAccessFile& file);

}  // namespace cairn::formats
