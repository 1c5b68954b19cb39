#include "formats/access/local_source.h"

#include <algorithm>

namespace cairn::formats {
namespace {

/// A disk is fast enough when it is asked.
class NoWishes : public WishList {
 public:
  void replace(std::span<const ByteRange>) override {}
};

}  // namespace

SharedBytes LocalSource::front(std::size_t size_bytes, Fresh) {
  std::vector<std::byte> bytes(
      static_cast<std::size_t>(std::min<std::uint64_t>(size_bytes, file_.size_bytes())));
  bytes.resize(file_.read_at_most(0, bytes));
  return std::make_shared<const std::vector<std::byte>>(std::move(bytes));
}

void LocalSource::expect_size(std::uint64_t size_bytes) {
  if (file_.size_bytes() != size_bytes) refuse_size(file_.path(), file_.size_bytes(), size_bytes);
}

std::vector<SharedBytes> LocalSource::read(std::span<const ByteRange> ranges,
                                           const std::stop_token& /*stop*/) const {
  std::vector<SharedBytes> all;
  all.reserve(ranges.size());
  for (const ByteRange& range : ranges) {
    std::vector<std::byte> bytes(static_cast<std::size_t>(range.size_bytes));
    file_.read_exactly(range.offset, bytes);
    all.push_back(std::make_shared<const std::vector<std::byte>>(std::move(bytes)));
  }
  return all;
}

std::unique_ptr<WishList> LocalSource::make_wish_list(std::function<void()>, std::uint64_t) const {
  return std::make_unique<NoWishes>();
}

}  // namespace cairn::formats
