#include "formats/scans/laz/laz_reader.h"

#include <algorithm>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/scans/las_reader.h"
#include "formats/scans/resize_block.h"

namespace cairn::formats {
namespace {

// Two chunks as LASzip makes them, or many of the small ones of COPC.
constexpr std::uint64_t kStretchPoints = 100'000;
// Resident memory of a worker, measured: what it takes at all, and the models of each extra byte.
constexpr std::uint64_t kWorkerBytes = std::uint64_t{72} << 20;
constexpr std::uint64_t kPointwiseModelBytes = 3 << 10;
constexpr std::uint64_t kLayeredModelBytes = 11 << 10;

constexpr std::size_t kChannelByte = 15;  // of a record of point format 6 to 8
constexpr std::byte kChannelBits{0x30};

/// The decoder follows the rules of version 3, which differ from those of version 4 where the scanner
/// channel changes within a chunk and there are fields beyond those of point format 6: then it gives
/// wrong values.
[[noreturn]] void refuse_channels(const LazChunk& chunk, const RandomAccessFile& file) {
  throw_input({.what = "LAZ items of version 4 are not read where the scanner channel changes",
               .path = file.path(),
               .offset = chunk.offset,
               .found = "points of several scanner channels in one chunk",
               .expected = "one scanner channel, items of version 3, or point format 6 alone"});
}

}  // namespace

bool have_one_channel(std::span<const std::byte> records, std::size_t record_bytes,
                      std::optional<std::byte>& channel) {
  for (std::size_t at = kChannelByte; at < records.size(); at += record_bytes) {
    const std::byte found = records[at] & kChannelBits;
    if (found != channel.value_or(found)) return false;
    channel = found;
  }
  return true;
}

LazReader::LazReader(const std::filesystem::path& path, const ScanOptions& options)
    : file_(path),
      header_(read_las_header(file_)),
      encoding_(read_laszip_record(file_, header_)),
      workers_(LazWorkers::shared()) {
  CAIRN_CHECK(header_.compressed);
  LazChunks found = read_chunk_table(file_, header_, encoding_, options.allow_truncated);
  chunks_ = std::move(found.chunks);
  info_.present_points = found.points;
  layout_ = describe_las(file_, header_, found.end, options.allow_truncated, info_);
  group_chunks();
}

void LazReader::group_chunks() {
  for (std::size_t i = 0; i < chunks_.size(); ++i) {
    if (stretches_.empty() || stretches_.back().points + chunks_[i].points > kStretchPoints)
      stretches_.push_back({.first_chunk = i});
    ++stretches_.back().chunks;
    stretches_.back().points += chunks_[i].points;
  }
}

std::uint64_t LazReader::stretch_capacity(std::size_t stretch) const {
  CAIRN_CHECK(stretch < stretches_.size());
  return stretches_[stretch].points;
}

std::uint64_t LazReader::read_bytes() const {
  std::uint64_t largest = 0;
  for (const LazChunk& chunk : chunks_) largest = std::max(largest, chunk.size_bytes);
  const std::uint64_t extra = header_.record_length_bytes - las_point_size(header_.point_format);
  // The chunk, and once more its layers.
  return kWorkerBytes + 2 * largest +
         extra * (encoding_.layered ? kLayeredModelBytes : kPointwiseModelBytes);
}

void LazReader::read(std::size_t stretch, const BlockSink& sink) const {
  CAIRN_CHECK(stretch < stretches_.size());
  const auto& [first, count, points] = stretches_[stretch];
  // A worker that failed, or whose records were not all taken, ends here.
  std::unique_ptr<LazWorker> worker = workers_->take();
  for (std::size_t chunk = first; chunk < first + count; ++chunk) read_chunk(chunk, *worker, sink);
  workers_->give_back(std::move(worker));
}

void LazReader::read_chunk(std::size_t chunk, LazWorker& worker, const BlockSink& sink) const {
  try {
    if (encoding_.layered) check_layered_chunk(file_, header_, encoding_, chunks_[chunk]);
    decode_chunk(chunks_[chunk], worker, sink);
  } catch (const LazWorkerFailure& failure) {
    throw Error(
        failure.was_killed() ? ErrorKind::kSystem : ErrorKind::kInput,
        {.what = fmt::format("LAZ chunk {} of {} cannot be decoded", chunk + 1, chunks_.size()),
         .path = file_.path(),
         .offset = chunks_[chunk].offset,
         .found = failure.what(),
         .expected = fmt::format("{} points", chunks_[chunk].points)});
  }
}

void LazReader::decode_chunk(const LazChunk& chunk, LazWorker& worker,
                             const BlockSink& sink) const {
  worker.send(file_, {.offset = chunk.offset,
                      .size_bytes = static_cast<std::uint32_t>(chunk.size_bytes),
                      .points = chunk.points,
                      .record_bytes = header_.record_length_bytes,
                      .point_format = header_.point_format});
  const std::uint16_t record_bytes = header_.record_length_bytes;
  const auto most = static_cast<std::uint32_t>(block_points_for(record_bytes));
  std::vector<std::byte> records;
  PointBlock block;
  std::optional<std::byte> channel;
  for (std::uint32_t left = chunk.points; left > 0;) {
    const std::uint32_t count = worker.receive(std::min(left, most), record_bytes, records);
    if (encoding_.follows_channels && !have_one_channel(records, record_bytes, channel))
      refuse_channels(chunk, file_);
    resize_block(info_.schema, info_.encoding, count, block);
    decode_las_records(layout_, records, 0, block);
    sink(block);
    left -= count;
  }
  worker.finish();
}

}  // namespace cairn::formats
