#include "formats/scans/e57/page_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/crc32c.h"
#include "formats/error.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kHeaderBytes = 48;
constexpr std::size_t kSignatureBytes = 8;  // "ASTM-E57", which has told the format
// The standard has 1024 alone; what else is read costs nothing, and is bounded by what is sane.
constexpr std::uint64_t kLeastPageBytes = 512, kMostPageBytes = std::uint64_t{1} << 20;

E57Header read_header(const RandomAccessFile& file) {
  std::array<std::byte, kHeaderBytes> bytes{};
  file.read_exactly(0, bytes);
  ByteReader in(std::span<const std::byte>(bytes).subspan(kSignatureBytes));
  E57Header header;
  header.version_major = in.read<std::uint32_t>().value();
  header.version_minor = in.read<std::uint32_t>().value();
  header.file_bytes = in.read<std::uint64_t>().value();
  header.xml_offset = in.read<std::uint64_t>().value();
  header.xml_bytes = in.read<std::uint64_t>().value();
  header.page_bytes = in.read<std::uint64_t>().value();
  return header;
}

void check_header(const E57Header& header, const RandomAccessFile& file, bool allow_truncated) {
  if (header.version_major > 1)
    throw_input({.what = "unknown E57 version",
                 .path = file.path(),
                 .offset = 8,
                 .found = fmt::format("{}.{}", header.version_major, header.version_minor),
                 .expected = "1.0"});
  if (header.page_bytes < kLeastPageBytes || header.page_bytes > kMostPageBytes ||
      !std::has_single_bit(header.page_bytes))
    throw_input({.what = "the pages of the E57 file have a size that cannot be",
                 .path = file.path(),
                 .offset = 40,
                 .found = fmt::format("{} bytes", header.page_bytes),
                 .expected = fmt::format("a power of two from {} to {}, as a rule 1024",
                                         kLeastPageBytes, kMostPageBytes)});
  if (file.size_bytes() < header.file_bytes && !allow_truncated)
    throw_input({.what = "the E57 file ends before what its header tells",
                 .path = file.path(),
                 .offset = file.size_bytes(),
                 .found = fmt::format("{} bytes", file.size_bytes()),
                 .expected = fmt::format("{}", header.file_bytes)});
}

}  // namespace

PageFile::PageFile(const std::filesystem::path& path, bool allow_truncated)
    : file_(path), header_(read_header(file_)) {
  check_header(header_, file_, allow_truncated);
  pages_ = std::min(file_.size_bytes(), header_.file_bytes) / header_.page_bytes;
  if (pages_ == 0)
    throw_input({.what = "the E57 file holds no whole page",
                 .path = path,
                 .offset = 0,
                 .found = fmt::format("{} bytes, of which the header tells {}", file_.size_bytes(),
                                      header_.file_bytes),
                 .expected = fmt::format("pages of {}", header_.page_bytes)});
  std::vector<std::byte> scratch, first;
  read_pages(0, 1, scratch, first);
}

std::optional<std::uint64_t> PageFile::logical(std::uint64_t physical) const {
  const std::uint64_t page = physical / header_.page_bytes, within = physical % header_.page_bytes;
  if (page >= pages_ || within >= payload_bytes()) return std::nullopt;
  return page * payload_bytes() + within;
}

std::uint64_t PageFile::physical(std::uint64_t logical) const {
  return logical / payload_bytes() * header_.page_bytes + logical % payload_bytes();
}

void PageFile::read_pages(std::uint64_t first, std::uint64_t count, std::vector<std::byte>& scratch,
                          std::vector<std::byte>& out) const {
  CAIRN_CHECK(first <= pages_ && count <= pages_ - first);
  const auto page_bytes = static_cast<std::size_t>(header_.page_bytes);
  const auto payload = static_cast<std::size_t>(payload_bytes());
  scratch.resize(static_cast<std::size_t>(count) * page_bytes);
  out.resize(static_cast<std::size_t>(count) * payload);
  file_.read_exactly(first * page_bytes, scratch);
  for (std::size_t i = 0; i < count; ++i) {
    const std::byte* page = scratch.data() + i * page_bytes;
    const auto told = load_be<std::uint32_t>(page + payload);
    const std::uint32_t computed = crc32c(std::span(page, payload));
    if (told != computed)
      throw_input({.what = "a damaged page: its checksum is not that of its bytes",
                   .path = file_.path(),
                   .offset = (first + i) * page_bytes,
                   .found = fmt::format("{:08x}", told),
                   .expected = fmt::format("{:08x}", computed)});
    std::memcpy(out.data() + i * payload, page, payload);
  }
}

PageWindow::PageWindow(const PageFile& file, std::size_t blocks, std::uint64_t block_bytes)
    : file_(file),
      block_pages_(std::max<std::uint64_t>(1, block_bytes / file.header().page_bytes)),
      blocks_(blocks) {}

std::uint64_t PageWindow::memory_bytes(const PageFile& file, std::size_t blocks,
                                       std::uint64_t block_bytes) {
  return (blocks + 1) * std::max(block_bytes, file.header().page_bytes);
}

const PageWindow::Block& PageWindow::block(std::uint64_t number) {
  ++uses_;
  Block* oldest = &blocks_.front();
  for (Block& candidate : blocks_) {
    if (candidate.number == number) {
      candidate.last_use = uses_;
      return candidate;
    }
    if (candidate.last_use < oldest->last_use) oldest = &candidate;
  }
  oldest->number.reset();
  const std::uint64_t first = number * block_pages_;
  file_.read_pages(first, std::min(block_pages_, file_.page_count() - first), scratch_,
                   oldest->bytes);
  oldest->number = number;
  oldest->last_use = uses_;
  return *oldest;
}

void PageWindow::read(std::uint64_t offset, std::span<std::byte> out) {
  const std::uint64_t end = file_.logical_bytes();
  if (offset > end || out.size() > end - offset)
    throw_input({.what = "the E57 file ends inside what is read",
                 .path = file_.path(),
                 .offset = file_.physical(end),
                 .expected = fmt::format("{} more bytes", offset - end + out.size())});
  const std::uint64_t block_bytes = block_pages_ * file_.payload_bytes();
  while (!out.empty()) {
    const Block& from = block(offset / block_bytes);
    const auto within = static_cast<std::size_t>(offset % block_bytes);
    const std::size_t size = std::min(out.size(), from.bytes.size() - within);
    std::memcpy(out.data(), from.bytes.data() + within, size);
    out = out.subspan(size);
    offset += size;
  }
}

}  // namespace cairn::formats
