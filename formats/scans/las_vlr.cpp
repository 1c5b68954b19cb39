#include "formats/scans/las_vlr.h"

#include <array>
#include <cstring>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/error.h"

namespace cairn::formats {
namespace {

// Above this all payloads kept together are no description of a coordinate system.
constexpr std::uint64_t kMaxKeptBytes = std::uint64_t{16} << 20;

/// Text of a fixed field, up to the first zero byte.
std::string text_of(const std::byte* bytes, std::size_t size) {
  const char* text = reinterpret_cast<const char*>(bytes);
  return {text, ::strnlen(text, size)};
}

bool is_extra_bytes_record(const VariableLengthRecord& record) {
  return record.user_id == "LASF_Spec" && record.record_id == kExtraBytesRecordId;
}

/// Walks over records of one kind, keeping the payloads that matter.
class RecordWalk {
 public:
  RecordWalk(const RandomAccessFile& file, std::uint64_t begin, std::uint64_t end, bool extended,
             LasRecords& kept)
      : file_(file), next_(begin), end_(end), extended_(extended), kept_(kept) {}

  /// Reads the record that begins here and moves behind it. False if it does not fit before the
  /// end.
  bool step() {
    std::array<std::byte, kLasEvlrHeaderBytes> bytes{};
    const std::size_t header_size = extended_ ? kLasEvlrHeaderBytes : kLasVlrHeaderBytes;
    if (header_size > end_ - next_) return false;
    file_.read_exactly(next_, std::span(bytes).first(header_size));
    const std::uint64_t size = extended_ ? load_le<std::uint64_t>(bytes.data() + 20)
                                         : load_le<std::uint16_t>(bytes.data() + 20);
    if (size > end_ - next_ - header_size) return false;
    VariableLengthRecord record;
    record.user_id = text_of(bytes.data() + 2, 16);
    record.record_id = load_le<std::uint16_t>(bytes.data() + 18);
    record.description = text_of(bytes.data() + header_size - 32, 32);
    keep(std::move(record), next_ + header_size, size);
    next_ += header_size + size;
    return true;
  }

  std::uint64_t position() const { return next_; }

 private:
  void keep(VariableLengthRecord record, std::uint64_t offset, std::uint64_t size) {
    const bool crs = is_crs_record(record);
    if (!crs && (!is_extra_bytes_record(record) || !kept_.extra_bytes.empty())) return;
    const std::uint64_t room = kMaxKeptBytes - kept_.kept_bytes;
    if (size > room || sizeof(VariableLengthRecord) > room - size)
      throw_input(
          {.what = fmt::format("record {}/{} is too large", record.user_id, record.record_id),
           .path = file_.path(),
           .offset = offset,
           .found = fmt::format("{} bytes", size),
           .expected = fmt::format("at most {} bytes in all", kMaxKeptBytes)});
    kept_.kept_bytes += size + sizeof(VariableLengthRecord);
    record.data.resize(static_cast<std::size_t>(size));
    file_.read_exactly(offset, record.data);
    if (crs)
      kept_.crs.push_back(std::move(record));
    else
      kept_.extra_bytes = std::move(record.data);
  }

  const RandomAccessFile& file_;
  std::uint64_t next_;
  std::uint64_t end_;
  bool extended_;
  LasRecords& kept_;
};

void read_vlrs(const RandomAccessFile& file, const LasHeader& header, LasRecords& kept) {
  RecordWalk walk(file, header.header_size_bytes, header.point_data_offset, false, kept);
  for (std::uint32_t i = 0; i < header.vlr_count; ++i)
    if (!walk.step()) return;
}

void read_evlrs(const RandomAccessFile& file, const LasHeader& header, std::uint64_t points_end,
                LasRecords& kept) {
  const auto refuse = [&](const char* what, std::size_t field, std::uint64_t found,
                          std::string expected) {
    throw_input({.what = what,
                 .path = file.path(),
                 .offset = field,
                 .found = fmt::format("{}", found),
                 .expected = std::move(expected)});
  };
  if (header.evlr_offset < points_end)
    refuse("the extended variable length records begin before the end of the points",
           kLasEvlrOffsetField, header.evlr_offset, fmt::format("at least {}", points_end));
  if (header.evlr_offset > file.size_bytes())
    refuse("the extended variable length records begin behind the end of the file",
           kLasEvlrOffsetField, header.evlr_offset, fmt::format("at most {}", file.size_bytes()));
  const std::uint64_t room = (file.size_bytes() - header.evlr_offset) / kLasEvlrHeaderBytes;
  if (header.evlr_count > room)
    refuse("the number of extended variable length records cannot be true", kLasEvlrCountField,
           header.evlr_count, fmt::format("at most {}", room));
  RecordWalk walk(file, header.evlr_offset, file.size_bytes(), true, kept);
  for (std::uint32_t i = 0; i < header.evlr_count; ++i)
    if (!walk.step())
      throw_input({.what = fmt::format("extended variable length record {} of {} does not fit",
                                       i + 1, header.evlr_count),
                   .path = file.path(),
                   .offset = walk.position()});
}

}  // namespace

bool is_wkt_record(const VariableLengthRecord& record) {
  return record.user_id == "LASF_Projection" &&
         (record.record_id == 2111 || record.record_id == 2112);
}

bool is_crs_record(const VariableLengthRecord& record) {
  return is_wkt_record(record) || (record.user_id == "LASF_Projection" &&
                                   record.record_id >= 34735 && record.record_id <= 34737);
}

LasRecords read_las_records(const RandomAccessFile& file, const LasHeader& header,
                            std::uint64_t points_end, bool allow_truncated) {
  LasRecords kept;
  read_vlrs(file, header, kept);
  if (header.evlr_count == 0) return kept;
  try {
    read_evlrs(file, header, points_end, kept);
  } catch (const Error& error) {
    if (!allow_truncated || error.kind() != ErrorKind::kInput) throw;
  }
  return kept;
}

}  // namespace cairn::formats
