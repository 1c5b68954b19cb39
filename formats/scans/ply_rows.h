// Reads the instances of a PLY element that have no fixed size, one at a time: lines of numbers,
// and binary instances with lists.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/buffered_reader.h"
#include "formats/scans/ply_header.h"

namespace cairn::formats {

class PlyRowSource {
 public:
  /// Reads instances of `element` from where `reader` stands. All three must outlive this object.
  PlyRowSource(const RandomAccessFile& file, PlyEncoding encoding, const PlyElement& element,
               BufferedReader& reader);

  /// Reads one instance and writes its scalars one after the other into `row`: little-endian for an
  /// ASCII file, in the file's own byte order for a binary one; lists are read and left out. `row`
  /// is empty (the instance is read and dropped) or has room for all scalars. `last` says that no
  /// more instances are promised: only then may an ASCII line lack its end. Returns false if the
  /// file ends before the end of the instance. Throws kInput where the bytes are no such instance.
  /// Blank lines are passed over.
  bool next(std::span<std::byte> row, bool last);

  /// From now on `next` also puts the items of this list into `items`, which must outlive this object. The
  /// property is a list of integers; a negative item is refused.
  void keep_list(const PlyProperty& property, std::vector<std::uint64_t>& items);

  /// Where in the file the instance begins that was read last.
  std::uint64_t row_offset() const { return row_offset_; }

 private:
  bool next_line(std::span<std::byte> row, bool last);
  bool next_binary(std::span<std::byte> row);
  bool pass_binary_list(const PlyProperty& property);
  std::int64_t parse_list_length(std::string_view token);
  void keep_text_item(const PlyProperty& property, std::string_view token);
  void keep_binary_items(const PlyProperty& property, std::uint64_t count);
  [[noreturn]] void refuse(std::string what, std::string_view found, std::string expected) const;

  const RandomAccessFile& file_;
  PlyEncoding encoding_;
  const PlyElement& element_;
  BufferedReader& reader_;
  std::uint64_t row_offset_ = 0;
  const PlyProperty* kept_ = nullptr;  ///< the list whose items are wanted, if any
  std::vector<std::uint64_t>* items_ = nullptr;
};

}  // namespace cairn::formats
