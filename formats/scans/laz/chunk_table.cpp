#include "formats/scans/laz/chunk_table.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/scans/laz/arithmetic_decoder.h"

namespace cairn::formats {
namespace {

constexpr std::uint64_t kOffsetBytes = 8;     // of the table's offset, before the first chunk
constexpr std::uint64_t kTableHeadBytes = 8;  // version and number of chunks
// No model gives a symbol more than 1 - 1/2^15, and a point takes several, one of them of 64 or more
// symbols: 1,430 points a byte is the most that any file can hold.
constexpr std::uint64_t kMostPointsPerByte = 2048;
// The decoder's memory is bounded.
constexpr std::uint64_t kMostChunkBytes = std::uint64_t{512} << 20;

struct FileAndHeader {
  const RandomAccessFile& file;
  const LasHeader& header;
  const LazEncoding& encoding;

  std::uint64_t first_chunk() const { return header.point_data_offset + kOffsetBytes; }

  [[noreturn]] void refuse(std::string what, std::uint64_t at, std::string found,
                           std::string expected) const {
    throw_input({.what = std::move(what),
                 .path = file.path(),
                 .offset = at,
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

  template <Scalar T>
  T read(std::uint64_t at) const {
    std::array<std::byte, sizeof(T)> bytes{};
    file.read_exactly(at, bytes);
    return load_le<T>(bytes.data());
  }
};

/// Offset of the table; nothing if the file ends before it.
std::optional<std::uint64_t> find_table(const FileAndHeader& laz) {
  const std::uint64_t begin = laz.header.point_data_offset;
  const std::uint64_t size = laz.file.size_bytes();
  if (size - begin < kOffsetBytes + kTableHeadBytes) return std::nullopt;
  auto offset = laz.read<std::int64_t>(begin);
  std::uint64_t told_at = begin;
  if (offset == -1) {  // the writer could not go back: the offset is at the end of the file
    told_at = size - kOffsetBytes;
    offset = laz.read<std::int64_t>(told_at);
    if (offset < 0 || static_cast<std::uint64_t>(offset) > told_at) return std::nullopt;
  }
  if (offset < 0 || static_cast<std::uint64_t>(offset) < laz.first_chunk())
    laz.refuse("the LAZ chunk table begins before the first chunk", told_at,
               fmt::format("{}", offset), fmt::format("at least {}", laz.first_chunk()));
  if (static_cast<std::uint64_t>(offset) > size - kTableHeadBytes) return std::nullopt;
  return static_cast<std::uint64_t>(offset);
}

/// A chunk's entry, as it stands in the table.
struct Entry {
  std::uint32_t points = 0;  ///< only if the chunks are of variable size
  std::uint32_t size_bytes = 0;
};

/// As many as the points fill, and one that a writer may have begun in vain.
std::uint64_t most_chunks(const FileAndHeader& laz) {
  const std::uint64_t points = std::max(laz.encoding.chunk_points, std::uint32_t{1});
  return laz.header.point_count / points + (laz.header.point_count % points != 0 ? 1 : 0) + 1;
}

/// Nothing if the file ends before the table.
std::optional<std::vector<Entry>> read_entries(const FileAndHeader& laz, std::uint64_t table) {
  if (const auto version = laz.read<std::uint32_t>(table); version != 0)
    laz.refuse("unknown version of the LAZ chunk table", table, fmt::format("{}", version), "0");
  const auto count = laz.read<std::uint32_t>(table + 4);
  const std::uint64_t room = (table - laz.first_chunk()) / laz.header.record_length_bytes;
  if (count > room)
    laz.refuse("the number of LAZ chunks cannot be true", table + 4, fmt::format("{}", count),
               fmt::format("at most {}, since each begins with a whole record", room));
  if (const std::uint64_t most = most_chunks(laz); count > most)
    laz.refuse("the number of LAZ chunks cannot be true", table + 4, fmt::format("{}", count),
               fmt::format("at most {} for {} points", most, laz.header.point_count));
  std::vector<Entry> entries;
  if (count == 0) return entries;

  constexpr std::uint64_t kMostEntryBytes = 16;
  const std::uint64_t begin = table + kTableHeadBytes;
  std::vector<std::byte> bytes(static_cast<std::size_t>(std::min<std::uint64_t>(
      laz.file.size_bytes() - begin, kMostEntryBytes * (count + std::uint64_t{1}))));
  laz.file.read_exactly(begin, bytes);
  ArithmeticDecoder decoder(bytes);
  IntegerDecoder integers(2);
  Entry last;
  while (entries.size() < count) {
    if (laz.encoding.chunk_points == 0) last.points = integers.decode(decoder, 0, last.points);
    last.size_bytes = integers.decode(decoder, 1, last.size_bytes);
    if (decoder.consumed_bytes() > bytes.size()) return std::nullopt;
    entries.push_back(last);
  }
  return entries;
}

void check_size(const FileAndHeader& laz, const LazChunk& chunk, std::size_t number) {
  if (chunk.size_bytes < laz.header.record_length_bytes)
    laz.refuse(fmt::format("LAZ chunk {} is too small", number), chunk.offset,
               fmt::format("{} bytes", chunk.size_bytes),
               fmt::format("at least {}, a whole record", laz.header.record_length_bytes));
  if (chunk.size_bytes > kMostChunkBytes)
    laz.refuse(fmt::format("LAZ chunk {} is too large to be decoded", number), chunk.offset,
               fmt::format("{} bytes", chunk.size_bytes),
               fmt::format("at most {}", kMostChunkBytes));
  if (chunk.points > chunk.size_bytes * kMostPointsPerByte)
    laz.refuse(fmt::format("LAZ chunk {} cannot hold so many points", number), chunk.offset,
               fmt::format("{} points in {} bytes", chunk.points, chunk.size_bytes),
               fmt::format("at most {} a byte", kMostPointsPerByte));
}

LazChunks place_chunks(const FileAndHeader& laz, const std::vector<Entry>& entries,
                       std::uint64_t table) {
  LazChunks placed{.chunks = {}, .points = 0, .end = laz.first_chunk()};
  std::uint64_t left = laz.header.point_count;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    LazChunk chunk{.offset = placed.end, .size_bytes = entries[i].size_bytes, .points = 0};
    const std::uint64_t claimed = laz.encoding.chunk_points == 0
                                      ? entries[i].points
                                      : std::min<std::uint64_t>(left, laz.encoding.chunk_points);
    if (claimed > left || chunk.size_bytes > table - placed.end ||
        (claimed == 0 && chunk.size_bytes > 0))
      laz.refuse(fmt::format("LAZ chunk {} of {} holds other than there is", i + 1, entries.size()),
                 chunk.offset, fmt::format("{} points in {} bytes", claimed, chunk.size_bytes),
                 fmt::format("at most {} points and {} bytes", left, table - placed.end));
    chunk.points = static_cast<std::uint32_t>(claimed);
    left -= claimed;
    placed.end += chunk.size_bytes;
    placed.points += claimed;
    if (chunk.points == 0) continue;
    check_size(laz, chunk, i + 1);
    placed.chunks.push_back(chunk);
  }
  if (placed.end != table || left != 0)
    laz.refuse("the LAZ chunk table does not tell all chunks", table,
               fmt::format("{} points, up to byte {}", placed.points, placed.end),
               fmt::format("{} points, up to byte {}", laz.header.point_count, table));
  return placed;
}

std::uint64_t layers_begin(const FileAndHeader& laz) {
  return laz.header.record_length_bytes + 4 + 4 * laz.encoding.layers;
}

/// The chunk that begins at `offset`, as it describes itself; nothing if the file ends within it.
std::optional<LazChunk> layered_chunk_at(const FileAndHeader& laz, std::uint64_t offset) {
  const std::uint64_t size = laz.file.size_bytes();
  if (offset > size || layers_begin(laz) > size - offset) return std::nullopt;
  std::vector<std::byte> head(4 + 4 * laz.encoding.layers);
  laz.file.read_exactly(offset + laz.header.record_length_bytes, head);
  LazChunk chunk{.offset = offset,
                 .size_bytes = layers_begin(laz),
                 .points = load_le<std::uint32_t>(head.data())};
  for (std::size_t layer = 0; layer < laz.encoding.layers; ++layer)
    chunk.size_bytes += load_le<std::uint32_t>(head.data() + 4 + 4 * layer);
  if (chunk.size_bytes > size - offset) return std::nullopt;
  return chunk;
}

/// The whole chunks of a file without a table. Each tells its size; what does not look like a chunk ends
/// the walk.
LazChunks walk_chunks(const FileAndHeader& laz) {
  LazChunks found{.chunks = {}, .points = 0, .end = laz.first_chunk()};
  while (const auto chunk = layered_chunk_at(laz, found.end)) {
    const bool plausible =
        chunk->points > 0 && chunk->points <= laz.header.point_count - found.points &&
        (laz.encoding.chunk_points == 0 || chunk->points <= laz.encoding.chunk_points) &&
        chunk->size_bytes <= kMostChunkBytes &&
        chunk->points <= chunk->size_bytes * kMostPointsPerByte;
    if (!plausible) break;
    found.chunks.push_back(*chunk);
    found.points += chunk->points;
    found.end += chunk->size_bytes;
  }
  found.end = std::min(found.end, laz.file.size_bytes());  // which may end before the first
  return found;
}

}  // namespace

LazChunks read_chunk_table(const RandomAccessFile& file, const LasHeader& header,
                           const LazEncoding& encoding, bool allow_truncated) {
  const FileAndHeader laz{file, header, encoding};
  if (const auto table = find_table(laz))
    if (const auto entries = read_entries(laz, *table)) return place_chunks(laz, *entries, *table);
  if (header.point_count == 0) return {.chunks = {}, .points = 0, .end = header.point_data_offset};
  if (allow_truncated && encoding.layered) return walk_chunks(laz);
  laz.refuse(
      "the file ends before its LAZ chunk table does, without which its points are not found",
      file.size_bytes(), fmt::format("{} bytes", file.size_bytes()),
      fmt::format("{} points and their chunk table", header.point_count));
}

void check_layered_chunk(const RandomAccessFile& file, const LasHeader& header,
                         const LazEncoding& encoding, const LazChunk& chunk) {
  const FileAndHeader laz{file, header, encoding};
  const auto told = layered_chunk_at(laz, chunk.offset);
  if (!told || told->points != chunk.points || told->size_bytes != chunk.size_bytes)
    laz.refuse("a LAZ chunk contradicts the chunk table", chunk.offset,
               told ? fmt::format("{} points in {} bytes", told->points, told->size_bytes)
                    : "layers that reach behind the end of the file",
               fmt::format("{} points in {} bytes", chunk.points, chunk.size_bytes));
}

}  // namespace cairn::formats
