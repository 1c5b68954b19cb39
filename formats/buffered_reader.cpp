#include "formats/buffered_reader.h"

#include <algorithm>
#include <cstring>
#include <string>

#include "formats/error.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kReadBytes = std::size_t{256} << 10;

}  // namespace

BufferedReader::BufferedReader(const RandomAccessFile& file, std::uint64_t offset)
    : file_(file), window_offset_(offset) {}

std::uint64_t BufferedReader::remaining() const {
  const std::uint64_t at = position();
  return at > file_.size_bytes() ? 0 : file_.size_bytes() - at;
}

void BufferedReader::fill(std::size_t size) {
  if (available() >= size) return;
  if (next_ > 0) std::memmove(window_.data(), window_.data() + next_, available());
  window_offset_ += next_;
  filled_ -= next_;
  next_ = 0;
  // A small file takes no large window; one byte more tells that a line without an end is over.
  const std::size_t wanted = std::max(
      size, static_cast<std::size_t>(std::min<std::uint64_t>(kReadBytes, file_.size_bytes() + 1)));
  // Doubled, since a long line asks for one byte more at a time.
  if (window_.size() < wanted)
    window_.resize(std::max(wanted, std::min(2 * window_.size(), kMaxLineBytes + 1)));
  filled_ += file_.read_at_most(window_offset_ + filled_, std::span(window_).subspan(filled_));
}

std::span<const std::byte> BufferedReader::take(std::size_t size) {
  CAIRN_CHECK(size <= kMaxLineBytes);
  fill(size);
  if (available() < size)
    throw_input({.what = "the file ends too early",
                 .path = file_.path(),
                 .offset = position(),
                 .found = std::to_string(available()) + " bytes",
                 .expected = std::to_string(size) + " bytes"});
  const auto part = std::span<const std::byte>(window_).subspan(next_, size);
  next_ += size;
  return part;
}

void BufferedReader::skip(std::uint64_t size) {
  if (size <= available()) {
    next_ += static_cast<std::size_t>(size);
    return;
  }
  if (size > remaining())
    throw_input({.what = "the file ends too early",
                 .path = file_.path(),
                 .offset = position(),
                 .found = std::to_string(remaining()) + " bytes",
                 .expected = std::to_string(size) + " bytes"});
  window_offset_ = position() + size;
  filled_ = next_ = 0;
}

bool BufferedReader::read_line(std::string_view& line) {
  std::size_t searched = 0;
  const std::byte* end = nullptr;
  while (end == nullptr) {
    if (searched == available()) {
      if (searched > kMaxLineBytes) break;
      fill(searched + 1);
      if (searched == available()) break;  // the end of the file
    }
    const std::byte* start = window_.data() + next_;
    end =
        static_cast<const std::byte*>(std::memchr(start + searched, '\n', available() - searched));
    if (end == nullptr) searched = available();
  }
  const std::size_t size =
      end == nullptr ? searched : static_cast<std::size_t>(end - (window_.data() + next_));
  if (size > kMaxLineBytes)
    throw_input(
        {.what = "a line is too long",
         .path = file_.path(),
         .offset = position(),
         .found = "more than " + std::to_string(kMaxLineBytes) + " bytes without an end of line"});
  if (end == nullptr && size == 0) return false;
  line = {reinterpret_cast<const char*>(window_.data() + next_), size};
  line_was_ended_ = end != nullptr;
  next_ += size + (line_was_ended_ ? 1 : 0);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return true;
}

}  // namespace cairn::formats
