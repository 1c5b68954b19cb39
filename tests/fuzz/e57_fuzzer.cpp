// Hostile E57 files behind pages whose checksums are right: damage that a checksum finds hides what the reader does with
// what it is told. (The scan target hands files over as they are.)
#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "formats/bytes.h"
#include "formats/crc32c.h"
#include "formats/scans/e57/e57_reader.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace cairn::fuzz {
namespace {

using namespace formats;

constexpr std::size_t kHeaderBytes = 48, kChecksumBytes = 4;
constexpr std::size_t kFileBytesAt = 16, kXmlOffsetAt = 24, kXmlBytesAt = 32, kPageBytesAt = 40;
constexpr std::uint64_t kUsualPageBytes = 1024;

/// The size of pages as the header tells it, if whole pages of it can be made of the input.
std::size_t page_bytes_of(const std::vector<std::byte>& file) {
  const auto told = load_le<std::uint64_t>(&file[kPageBytesAt]);
  return static_cast<std::size_t>(told >= 64 && told <= 4 * kUsualPageBytes ? told
                                                                            : kUsualPageBytes);
}

/// Lets the header tell of the XML where it has moved to; all of what follows it is XML.
void point_to_xml(std::vector<std::byte>& file, std::size_t page_bytes) {
  constexpr std::array kBegin{std::byte{'<'}, std::byte{'?'}, std::byte{'x'}, std::byte{'m'},
                              std::byte{'l'}};
  const auto at = std::search(file.begin(), file.end(), kBegin.begin(), kBegin.end());
  if (at == file.end()) return;
  const auto offset = static_cast<std::uint64_t>(at - file.begin());
  const std::uint64_t pages = file.size() / page_bytes;
  const std::uint64_t before =
      offset / page_bytes * (page_bytes - kChecksumBytes) + offset % page_bytes;
  store_le(&file[kXmlOffsetAt], offset);
  // What is left behind the XML's end is no part of it: blanks and zeros of the last page.
  std::uint64_t end = file.size();
  while (end > offset && file[end - 1] != std::byte{'>'}) --end;
  const std::uint64_t logical_end =
      end / page_bytes * (page_bytes - kChecksumBytes) +
      std::min<std::uint64_t>(end % page_bytes, page_bytes - kChecksumBytes);
  if (logical_end > before && logical_end <= pages * (page_bytes - kChecksumBytes))
    store_le(&file[kXmlBytesAt], logical_end - before);
}

void seal(std::vector<std::byte>& file, std::size_t page_bytes) {
  const std::size_t payload = page_bytes - kChecksumBytes;
  for (std::size_t page = 0; page + page_bytes <= file.size(); page += page_bytes) {
    const std::uint32_t crc = crc32c(std::span(file).subspan(page, payload));
    for (std::size_t i = 0; i < kChecksumBytes; ++i)
      file[page + payload + i] = static_cast<std::byte>(crc >> (24 - 8 * i));
  }
}

void read_all(const std::filesystem::path& path, bool allow_truncated) {
  for (const auto& reader : open_e57(path, {.allow_truncated = allow_truncated})) {
    std::uint64_t capacity = 0;
    for (std::size_t stretch = 0; stretch < reader->stretch_count(); ++stretch) {
      std::uint64_t records = 0;
      reader->read(stretch,
                   [&](const PointBlock& block) { records += block.count + block.no_return; });
      require(records == reader->stretch_capacity(stretch));
      capacity += reader->stretch_capacity(stretch);
    }
    require(capacity == reader->info().present_points);
    require(capacity <= reader->info().claimed_points);
    require(allow_truncated || capacity == reader->info().claimed_points);
  }
}

}  // namespace

/// An input is a file as it lies on disk, whatever its checksums. The last page is filled up. Of one size in eight the
/// header is left to lie about file and XML; else it is told where they are, as inserted bytes move them.
void run(std::span<const std::byte> bytes) {
  static const MemoryFile file;
  std::vector<std::byte> sealed(bytes.begin(), bytes.end());
  sealed.resize(std::max(sealed.size(), kHeaderBytes));
  const std::size_t page_bytes = page_bytes_of(sealed);
  sealed.resize((sealed.size() + page_bytes - 1) / page_bytes * page_bytes);
  if (bytes.size() % 8 != 7) {
    store_le<std::uint64_t>(&sealed[kFileBytesAt], sealed.size());
    point_to_xml(sealed, page_bytes);
  }
  seal(sealed, page_bytes);
  file.assign(sealed);
  for (const bool allow_truncated : {false, true})
    accepts({ErrorKind::kInput}, [&] { read_all(file.path(), allow_truncated); });
}

}  // namespace cairn::fuzz
