#include "formats/scans/laz/laszip_record.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/scans/las_header.h"
#include "formats/scans/las_layout.h"

namespace cairn::formats {
namespace {

constexpr std::string_view kUserId = "laszip encoded";
constexpr std::uint16_t kRecordId = 22204;

// Offsets in the record.
constexpr std::size_t kCompressor = 0;
constexpr std::size_t kCoder = 2;
constexpr std::size_t kChunkPoints = 12;
constexpr std::size_t kItemCount = 32;
constexpr std::size_t kItems = 34;
constexpr std::size_t kItemBytes = 6;

constexpr std::uint16_t kWithoutChunks = 1;
constexpr std::uint16_t kPointwise = 2;
constexpr std::uint16_t kLayered = 3;
constexpr std::uint16_t kNewestItemVersion = 4;
constexpr std::uint32_t kVariableChunks = 0xffffffffU;

enum ItemType : std::uint16_t {
  kByte = 0,
  kPoint10 = 6,
  kGpsTime11 = 7,
  kRgb12 = 8,
  kWavePacket13 = 9,
  kPoint14 = 10,
  kRgb14 = 11,
  kRgbNir14 = 12,
  kWavePacket14 = 13,
  kByte14 = 14,
};

constexpr std::array<std::string_view, 15> kItemNames{
    "BYTE",  "SHORT",        "INT",     "LONG",  "FLOAT",    "DOUBLE",       "POINT10", "GPSTIME11",
    "RGB12", "WAVEPACKET13", "POINT14", "RGB14", "RGBNIR14", "WAVEPACKET14", "BYTE14"};

struct Item {
  std::uint16_t type = 0;
  std::uint16_t size_bytes = 0;
  std::uint16_t version = 0;

  std::string text() const {
    return fmt::format("{} of {} bytes, version {}", kItemNames[type], size_bytes, version);
  }
};

class Record {
 public:
  Record(const RandomAccessFile& file, std::uint64_t offset, std::vector<std::byte> bytes)
      : file_(file), offset_(offset), bytes_(std::move(bytes)) {
    if (bytes_.size() < kItems)
      refuse("the LASzip record is cut short", 0, fmt::format("{} bytes", bytes_.size()),
             fmt::format("at least {} bytes", kItems));
  }

  template <Scalar T>
  T get(std::size_t at) const {
    return load_le<T>(bytes_.data() + at);
  }
  std::size_t size() const { return bytes_.size(); }

  [[noreturn]] void refuse(std::string what, std::size_t at, std::string found,
                           std::string expected) const {
    throw_input({.what = std::move(what),
                 .path = file_.path(),
                 .offset = offset_ + at,
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

 private:
  const RandomAccessFile& file_;
  std::uint64_t offset_;
  std::vector<std::byte> bytes_;
};

Record find_record(const RandomAccessFile& file, const LasHeader& header) {
  std::uint64_t next = header.header_size_bytes;
  const std::uint64_t end = header.point_data_offset;
  for (std::uint32_t i = 0; i < header.vlr_count && end - next >= kLasVlrHeaderBytes; ++i) {
    std::array<std::byte, kLasVlrHeaderBytes> head{};
    file.read_exactly(next, head);
    next += kLasVlrHeaderBytes;
    const auto size = load_le<std::uint16_t>(head.data() + 20);
    if (size > end - next) break;
    const char* user_id = reinterpret_cast<const char*>(head.data() + 2);
    if (std::string_view(user_id, ::strnlen(user_id, 16)) == kUserId &&
        load_le<std::uint16_t>(head.data() + 18) == kRecordId) {
      std::vector<std::byte> bytes(size);
      file.read_exactly(next, bytes);
      return {file, next, std::move(bytes)};
    }
    next += size;
  }
  throw_input({.what = "the points are compressed and no record says how",
               .path = file.path(),
               .offset = next,
               .expected = "a LASzip record (\"laszip encoded\" 22204) before the points"});
}

std::vector<Item> read_items(const Record& record) {
  const auto count = record.get<std::uint16_t>(kItemCount);
  if (record.size() - kItems < count * kItemBytes)
    record.refuse("the LASzip record is cut short", kItemCount,
                  fmt::format("{} items in {} bytes", count, record.size() - kItems),
                  fmt::format("{} bytes an item", kItemBytes));
  std::vector<Item> items(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = kItems + i * kItemBytes;
    items[i] = {.type = record.get<std::uint16_t>(at),
                .size_bytes = record.get<std::uint16_t>(at + 2),
                .version = record.get<std::uint16_t>(at + 4)};
    if (items[i].type >= kItemNames.size())
      record.refuse("unknown LASzip item type", at, fmt::format("{}", items[i].type),
                    fmt::format("at most {}", kItemNames.size() - 1));
    if (items[i].version > kNewestItemVersion)
      record.refuse("unknown LASzip item version", at + 4, items[i].text(),
                    fmt::format("at most version {}", kNewestItemVersion));
  }
  return items;
}

/// The items that make up the records of a point format, versions left open.
std::vector<Item> expected_items(std::uint8_t point_format, std::uint16_t record_bytes) {
  std::vector<Item> items;
  const bool wide = las_is_wide(point_format);
  items.push_back({.type = wide ? kPoint14 : kPoint10,
                   .size_bytes = static_cast<std::uint16_t>(las_point_size(wide ? 6 : 0))});
  if (point_format == 1 || point_format == 3) items.push_back({kGpsTime11, 8});
  if (point_format == 2 || point_format == 3) items.push_back({kRgb12, 6});
  if (point_format == 7) items.push_back({kRgb14, 6});
  if (point_format == 8) items.push_back({kRgbNir14, 8});
  const std::size_t extra = record_bytes - las_point_size(point_format);
  if (extra > 0) items.push_back({wide ? kByte14 : kByte, static_cast<std::uint16_t>(extra)});
  return items;
}

void check_items(const Record& record, const LasHeader& header, const std::vector<Item>& items) {
  const auto expected = expected_items(header.point_format, header.record_length_bytes);
  const auto same = [](const Item& a, const Item& b) {
    return a.type == b.type && a.size_bytes == b.size_bytes;
  };
  if (!std::equal(items.begin(), items.end(), expected.begin(), expected.end(), same)) {
    std::vector<std::string> found;
    found.reserve(items.size());
    for (const Item& item : items) found.push_back(item.text());
    record.refuse(fmt::format("the LASzip items do not make up records of point format {}",
                              header.point_format),
                  kItems, fmt::format("{}", fmt::join(found, "; ")),
                  fmt::format("{} items, {} bytes", expected.size(), header.record_length_bytes));
  }
  const bool wide = las_is_wide(header.point_format);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const bool known = wide ? items[i].version == items[0].version && items[i].version >= 3
                            : items[i].version == 2;
    if (!known)
      record.refuse("a LASzip item of a version that is not read", kItems + i * kItemBytes + 4,
                    items[i].text(), wide ? "all of version 3 or of version 4" : "version 2");
  }
}

void refuse_waveforms(const RandomAccessFile& file, const LasHeader& header) {
  if (las_field_offsets(header.point_format).waveform == 0) return;
  throw_input({.what = "LAZ with waveforms is not read",
               .path = file.path(),
               .offset = kLasPointFormatField,
               .found = fmt::format("point format {}", header.point_format),
               .expected = "point format 0 to 3 or 6 to 8"});
}

void check_compressor(const Record& record, const LasHeader& header) {
  const auto compressor = record.get<std::uint16_t>(kCompressor);
  if (compressor == kWithoutChunks)
    record.refuse("LAZ of LASzip 1, without chunks, is not read", kCompressor,
                  "compressor 1 (pointwise)", "compressor 2 or 3 (pointwise or layered, chunked)");
  const std::uint16_t fitting = las_is_wide(header.point_format) ? kLayered : kPointwise;
  if (compressor != fitting)
    record.refuse("the LASzip compressor does not fit the point format", kCompressor,
                  fmt::format("compressor {} for point format {}", compressor, header.point_format),
                  fmt::format("compressor {}", fitting));
}

}  // namespace

LazEncoding read_laszip_record(const RandomAccessFile& file, const LasHeader& header) {
  const Record record = find_record(file, header);
  const auto compressor = record.get<std::uint16_t>(kCompressor);
  if (compressor < kWithoutChunks || compressor > kLayered)
    record.refuse("unknown LASzip compressor", kCompressor, fmt::format("{}", compressor),
                  "1 to 3");
  if (const auto coder = record.get<std::uint16_t>(kCoder); coder != 0)
    record.refuse("unknown LASzip coder", kCoder, fmt::format("{}", coder), "0 (arithmetic)");
  const std::vector<Item> items = read_items(record);
  refuse_waveforms(file, header);
  check_compressor(record, header);
  check_items(record, header, items);

  LazEncoding encoding;
  encoding.layered = compressor == kLayered;
  const auto chunk_points = record.get<std::uint32_t>(kChunkPoints);
  if (chunk_points == 0)
    record.refuse("the LASzip chunk size is unusable", kChunkPoints, "0", "at least 1");
  encoding.chunk_points = chunk_points == kVariableChunks ? 0 : chunk_points;
  encoding.follows_channels = items[0].version == 4 && items.size() > 1;
  if (encoding.layered) {
    constexpr std::size_t kPointLayers = 9;
    const std::size_t extra = header.record_length_bytes - las_point_size(header.point_format);
    encoding.layers = kPointLayers + (header.point_format - 6u) + extra;
  }
  return encoding;
}

}  // namespace cairn::formats
