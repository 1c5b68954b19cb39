// Reads LAZ, COPC among it: LAS whose records are compressed in chunks. The chunk table is read here,
// the chunks are decoded by worker processes (worker.h), and what they give back is decoded as any
// LAS record. A COPC file is read through its chunk table alone, which tells all its points.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "formats/random_access_file.h"
#include "formats/scans/las_header.h"
#include "formats/scans/las_layout.h"
#include "formats/scans/laz/chunk_table.h"
#include "formats/scans/laz/laszip_record.h"
#include "formats/scans/laz/worker.h"
#include "formats/scans/scan_reader.h"

namespace cairn::formats {

/// Whether all records, of point format 6 to 8, are of one scanner channel and that of the records before, if there
/// were some; then `channel` is theirs.
bool have_one_channel(std::span<const std::byte> records, std::size_t record_bytes,
                      std::optional<std::byte>& channel);

class LazReader : public ScanReader {
 public:
  /// Opens and checks the file: see read_las_header, read_laszip_record and read_chunk_table.
  LazReader(const std::filesystem::path& path, const ScanOptions& options);

  std::size_t stretch_count() const override { return stretches_.size(); }
  std::uint64_t stretch_capacity(std::size_t stretch) const override;
  std::uint64_t read_bytes() const override;
  /// Also throws kSystem if a worker cannot be started or is killed.
  void read(std::size_t stretch, const BlockSink& sink) const override;

 private:
  /// Neighbouring chunks that are read together.
  struct Stretch {
    std::size_t first_chunk = 0;
    std::size_t chunks = 0;
    std::uint64_t points = 0;
  };

  void group_chunks();
  void read_chunk(std::size_t chunk, LazWorker& worker, const BlockSink& sink) const;
  void decode_chunk(const LazChunk& chunk, LazWorker& worker, const BlockSink& sink) const;

  RandomAccessFile file_;
  LasHeader header_;
  LazEncoding encoding_;
  LasLayout layout_;
  std::vector<LazChunk> chunks_;
  std::vector<Stretch> stretches_;
  std::shared_ptr<LazWorkers> workers_;
};

}  // namespace cairn::formats
