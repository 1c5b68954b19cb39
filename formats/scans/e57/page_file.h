// An E57 file as its pages: the file is divided into pages that end in a checksum each. What stands between the checksums
// is the logical file. Headers and XML tell physical offsets, sections tell logical lengths.
// Based on: ASTM E2807-11, "Standard Specification for 3D Imaging Data Exchange", 2011, section 7.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "formats/random_access_file.h"

namespace cairn::formats {

/// The 48 bytes that an E57 file begins with, behind their signature.
struct E57Header {
  std::uint32_t version_major = 0;
  std::uint32_t version_minor = 0;
  std::uint64_t file_bytes = 0;  ///< physical
  std::uint64_t xml_offset = 0;  ///< physical
  std::uint64_t xml_bytes = 0;   ///< logical
  std::uint64_t page_bytes = 0;
};

class PageFile {
 public:
  /// Opens the file and checks its header and first page. Throws kInput for a damaged header, and where the file ends
  /// before what its header tells unless `allow_truncated`; then its whole pages are all there is.
  PageFile(const std::filesystem::path& path, bool allow_truncated);

  const std::filesystem::path& path() const { return file_.path(); }
  const E57Header& header() const { return header_; }
  /// Whether the file ends before what its header tells.
  bool is_cut() const { return file_.size_bytes() < header_.file_bytes; }
  /// Bytes of the logical file that are there.
  std::uint64_t logical_bytes() const { return pages_ * payload_bytes(); }

  /// Bytes of a page before its checksum.
  std::uint64_t payload_bytes() const { return header_.page_bytes - kChecksumBytes; }
  /// Nothing for an offset inside a checksum or behind the last page.
  std::optional<std::uint64_t> logical(std::uint64_t physical) const;
  std::uint64_t physical(std::uint64_t logical) const;

  /// Fills `out` with the payloads of `count` pages from `first` on, which must be there; `scratch` holds them before.
  /// Throws kInput for a page with a wrong checksum. May be called by several threads at a time.
  void read_pages(std::uint64_t first, std::uint64_t count, std::vector<std::byte>& scratch,
                  std::vector<std::byte>& out) const;
  std::uint64_t page_count() const { return pages_; }

 private:
  static constexpr std::uint64_t kChecksumBytes = 4;

  RandomAccessFile file_;
  E57Header header_;
  std::uint64_t pages_ = 0;
};

/// Reads the logical file through the blocks of pages that were used last, each checked when it is read. For one thread.
class PageWindow {
 public:
  /// `file` must outlive the window.
  PageWindow(const PageFile& file, std::size_t blocks, std::uint64_t block_bytes);

  /// Fills `out` with the logical bytes from `offset` on. Throws kInput for a damaged page and where the file ends.
  void read(std::uint64_t offset, std::span<std::byte> out);

  /// What a window of so many blocks holds in memory.
  static std::uint64_t memory_bytes(const PageFile& file, std::size_t blocks,
                                    std::uint64_t block_bytes);

 private:
  struct Block {
    std::optional<std::uint64_t> number;
    std::uint64_t last_use = 0;
    std::vector<std::byte> bytes;
  };

  const Block& block(std::uint64_t number);

  const PageFile& file_;
  std::uint64_t block_pages_;
  std::uint64_t uses_ = 0;
  std::vector<std::byte> scratch_;
  std::vector<Block> blocks_;
};

}  // namespace cairn::formats
