// Reads the vertices of a PLY file, ASCII or binary of either byte order. Binary vertices of fixed
// size are split into stretches; others are one stretch.
#pragma once

#include <cstdint>
#include <filesystem>

#include "formats/random_access_file.h"
#include "formats/scans/ply_header.h"
#include "formats/scans/ply_layout.h"
#include "formats/scans/scan_reader.h"

namespace cairn::formats {

class PlyReader : public ScanReader {
 public:
  /// Opens and checks the file; passes over the elements before the vertices. Throws kInput for a
  /// damaged header, for one without a vertex element or without x, y and z, and for a vertex count
  /// that the file is too small for, unless `options.allow_truncated`.
  PlyReader(const std::filesystem::path& path, const ScanOptions& options);

  std::size_t stretch_count() const override;
  std::uint64_t stretch_capacity(std::size_t stretch) const override;
  void read(std::size_t stretch, const BlockSink& sink) const override;

 private:
  const PlyElement& vertex() const { return header_.elements[vertex_]; }
  bool fixed_size() const;
  /// Sets vertices_offset_; returns false if the file ends before the vertices.
  bool find_vertices();
  bool skip_element(const PlyElement& element, std::uint64_t& offset) const;
  std::uint64_t most_points() const;
  void check_rest() const;
  void read_varying(const BlockSink& sink) const;
  [[noreturn]] void refuse_truncated(std::uint64_t present) const;

  RandomAccessFile file_;
  PlyHeader header_;
  std::size_t vertex_ = 0;  ///< index of the vertex element
  RowLayout layout_;
  std::uint64_t vertices_offset_ = 0;
  bool allow_truncated_ = false;
};

}  // namespace cairn::formats
