#include "formats/scans/las_header.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/scans/las_layout.h"

namespace cairn::formats {
namespace {

// Byte offsets of the fields in the header.
constexpr std::size_t kGlobalEncoding = 6;
constexpr std::size_t kVersionMajor = 24;
constexpr std::size_t kVersionMinor = 25;
constexpr std::size_t kHeaderSize = 94;
constexpr std::size_t kPointDataOffset = 96;
constexpr std::size_t kVlrCount = 100;
constexpr std::size_t kRecordLength = 105;
constexpr std::size_t kLegacyPointCount = 107;
constexpr std::size_t kScale = 131;
constexpr std::size_t kOffset = 155;
constexpr std::size_t kWaveformOffset = 227;
constexpr std::size_t kPointCount = 247;

constexpr std::uint16_t kSmallestHeader = 227;
constexpr std::uint16_t kLargestHeader = 393;
constexpr std::uint16_t kInternalWaveformBit = 2;

/// The bytes of a header and the file they come from, for messages.
class Fields {
 public:
  explicit Fields(const RandomAccessFile& file) : file_(file) {
    size_ = file.read_at_most(0, bytes_);
    if (size_ < 4 || std::memcmp(bytes_.data(), "LASF", 4) != 0)
      refuse("not a LAS file", 0, "", "the signature LASF");
    if (size_ < kSmallestHeader)
      refuse("the LAS header is cut short", size_, fmt::format("{} bytes", size_),
             fmt::format("at least {} bytes", kSmallestHeader));
  }

  template <Scalar T>
  T get(std::size_t at) const {
    return load_le<T>(bytes_.data() + at);
  }

  [[noreturn]] void refuse(std::string what, std::size_t at, std::string found,
                           std::string expected) const {
    throw_input({.what = std::move(what),
                 .path = file_.path(),
                 .offset = at,
                 .found = std::move(found),
                 .expected = std::move(expected)});
  }

 private:
  const RandomAccessFile& file_;
  std::array<std::byte, kLargestHeader> bytes_{};
  std::size_t size_ = 0;
};

void read_version(const Fields& fields, LasHeader& header) {
  const auto major = fields.get<std::uint8_t>(kVersionMajor);
  header.version_minor = fields.get<std::uint8_t>(kVersionMinor);
  if (major != 1 || header.version_minor > 5)
    fields.refuse("unknown LAS version", kVersionMajor,
                  fmt::format("{}.{}", major, header.version_minor), "1.0 to 1.5");
  header.global_encoding = fields.get<std::uint16_t>(kGlobalEncoding);
}

void read_sizes(const Fields& fields, std::uint64_t file_size, LasHeader& header) {
  header.header_size_bytes = fields.get<std::uint16_t>(kHeaderSize);
  // Headers of 1.3 and 1.5 that lack their newest fields are readable; without those of 1.4 the
  // counts would be missing.
  const std::uint16_t needed = header.version_minor >= 4 ? las_header_size(4) : kSmallestHeader;
  if (header.header_size_bytes < needed)
    fields.refuse("the header size of this LAS version is too small", kHeaderSize,
                  fmt::format("{} bytes", header.header_size_bytes),
                  fmt::format("at least {} bytes", needed));
  if (header.header_size_bytes > file_size)
    fields.refuse("the LAS header is cut short", kHeaderSize, fmt::format("{} bytes", file_size),
                  fmt::format("{} bytes", header.header_size_bytes));
  header.point_data_offset = fields.get<std::uint32_t>(kPointDataOffset);
  if (header.point_data_offset < header.header_size_bytes)
    fields.refuse("the offset to point data lies inside the header", kPointDataOffset,
                  fmt::format("{}", header.point_data_offset),
                  fmt::format("at least {}", header.header_size_bytes));
  if (header.point_data_offset > file_size)
    fields.refuse("the offset to point data lies behind the end of the file", kPointDataOffset,
                  fmt::format("{}", header.point_data_offset),
                  fmt::format("at most {}", file_size));
}

void read_point_format(const Fields& fields, LasHeader& header) {
  // The two upper bits mark LAZ: bit 7 in all files, bit 6 in those of an early compressor.
  const auto byte = fields.get<std::uint8_t>(kLasPointFormatField);
  header.compressed = (byte & 0xc0) != 0;
  header.point_format = byte & 0x3f;
  if (header.point_format > kMaxLasPointFormat)
    // With the whole byte, which is what stands in the file.
    fields.refuse("unknown LAS point format", kLasPointFormatField,
                  header.compressed
                      ? fmt::format("{} (LAZ of format {})", byte, header.point_format)
                      : fmt::format("{}", byte),
                  "0 to 10");
  header.record_length_bytes = fields.get<std::uint16_t>(kRecordLength);
  const std::size_t needed = las_point_size(header.point_format);
  if (header.record_length_bytes < needed)
    fields.refuse(
        "the point record length is too small", kRecordLength,
        fmt::format("{} bytes", header.record_length_bytes),
        fmt::format("at least {} bytes for point format {}", needed, header.point_format));
}

void read_counts(const Fields& fields, LasHeader& header) {
  header.vlr_count = fields.get<std::uint32_t>(kVlrCount);
  const std::uint32_t vlr_room =
      (header.point_data_offset - header.header_size_bytes) / kLasVlrHeaderBytes;
  if (header.vlr_count > vlr_room)
    fields.refuse("the number of variable length records cannot be true", kVlrCount,
                  fmt::format("{}", header.vlr_count),
                  fmt::format("at most {}, for which there is room before the points", vlr_room));
  const auto legacy = fields.get<std::uint32_t>(kLegacyPointCount);
  header.point_count = legacy;
  if (header.version_minor >= 3 && header.header_size_bytes >= las_header_size(3) &&
      (header.global_encoding & kInternalWaveformBit) != 0)
    header.waveform_offset = fields.get<std::uint64_t>(kWaveformOffset);
  if (header.version_minor < 4) return;
  header.evlr_offset = fields.get<std::uint64_t>(kLasEvlrOffsetField);
  header.evlr_count = fields.get<std::uint32_t>(kLasEvlrCountField);
  const auto count = fields.get<std::uint64_t>(kPointCount);
  // The legacy count is 0 or the same number. Writers that know only the legacy field leave the
  // other 0; above 32 bits the legacy field means nothing.
  if (legacy != 0 && count != 0 && legacy != count &&
      count <= std::numeric_limits<std::uint32_t>::max())
    fields.refuse("the legacy point count and the point count differ", kLegacyPointCount,
                  fmt::format("{}", legacy), fmt::format("0 or {}", count));
  if (count != 0) header.point_count = count;
}

void read_scales(const Fields& fields, LasHeader& header) {
  constexpr char kAxes[] = "xyz";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t scale_at = kScale + 8 * axis;
    const std::size_t offset_at = kOffset + 8 * axis;
    const double scale = fields.get<double>(scale_at);
    const double offset = fields.get<double>(offset_at);
    if (!std::isfinite(scale) || scale <= 0)
      fields.refuse(fmt::format("the {} scale is unusable", kAxes[axis]), scale_at,
                    fmt::format("{}", scale), "a finite number above 0");
    if (!std::isfinite(offset) || !std::isfinite(std::fabs(offset) + scale * 2147483648.0))
      fields.refuse(fmt::format("the {} offset is unusable", kAxes[axis]), offset_at,
                    fmt::format("{} with scale {}", offset, scale),
                    "numbers that give finite coordinates");
    header.scale[axis] = scale;
    header.offset[axis] = offset;
  }
}

}  // namespace

std::uint16_t las_header_size(std::uint8_t version_minor) {
  if (version_minor <= 2) return 227;
  if (version_minor == 3) return 235;
  return version_minor == 4 ? 375 : 393;
}

LasHeader read_las_header(const RandomAccessFile& file) {
  const Fields fields(file);
  LasHeader header;
  read_version(fields, header);
  read_sizes(fields, file.size_bytes(), header);
  read_point_format(fields, header);
  read_counts(fields, header);
  read_scales(fields, header);
  return header;
}

}  // namespace cairn::formats
