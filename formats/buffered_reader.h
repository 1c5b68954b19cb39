// Reads a file front to back through a bounded window: bytes, lines, and skips. For text, and for
// binary records whose size is known only once they are read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "formats/random_access_file.h"

namespace cairn::formats {

class BufferedReader {
 public:
  /// Longest line that `read_line` returns, in bytes without its end.
  static constexpr std::size_t kMaxLineBytes = std::size_t{1} << 20;

  /// Begins at byte `offset`. `file` must outlive the reader.
  explicit BufferedReader(const RandomAccessFile& file, std::uint64_t offset = 0);

  /// Position in the file of the next byte.
  std::uint64_t position() const { return window_offset_ + next_; }
  /// Bytes left, by the file's size when it was opened.
  std::uint64_t remaining() const;

  /// The next `size` bytes (at most kMaxLineBytes), valid until the next call. Throws kInput if the
  /// file ends before.
  std::span<const std::byte> take(std::size_t size);

  /// Moves on without reading. Throws kInput if the file ends before.
  void skip(std::uint64_t size);

  /// The next line without its end ("\n" or "\r\n"), valid until the next call; the last line need
  /// not have an end. Returns false at the end of the file. Throws kInput if the line is longer
  /// than kMaxLineBytes.
  bool read_line(std::string_view& line);
  /// Whether the line read last had an end, and was not cut off by the end of the file.
  bool line_was_ended() const { return line_was_ended_; }

 private:
  /// Makes the window hold at least `size` bytes from `next_` on, or all that the file has.
  void fill(std::size_t size);
  std::size_t available() const { return filled_ - next_; }

  const RandomAccessFile& file_;
  std::vector<std::byte> window_;
  std::uint64_t window_offset_;  ///< in the file, of window_[0]
  std::size_t filled_ = 0;       ///< bytes of the window that are valid
  bool line_was_ended_ = false;  ///< of the line read last
  std::size_t next_ = 0;         ///< index in the window of the next byte
};

}  // namespace cairn::formats
