// A file on a disk, read by position.
#pragma once

#include "formats/access/byte_source.h"
#include "formats/random_access_file.h"

namespace cairn::formats {

class LocalSource : public ByteSource {
 public:
  /// Throws as RandomAccessFile does.
  explicit LocalSource(const std::filesystem::path& path) : file_(path) {}

  const std::filesystem::path& path() const override { return file_.path(); }
  std::uint64_t size_bytes() const override { return file_.size_bytes(); }
  SharedBytes front(std::size_t size_bytes, Fresh fresh) override;
  void expect_size(std::uint64_t size_bytes) override;
  std::vector<SharedBytes> read(std::span<const ByteRange> ranges,
                                const std::stop_token& stop) const override;
  std::unique_ptr<WishList> make_wish_list(std::function<void()> arrived,
                                           std::uint64_t together_bytes) const override;

 private:
  RandomAccessFile file_;
};

}  // namespace cairn::formats
