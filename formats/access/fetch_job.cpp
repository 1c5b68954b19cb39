#include "formats/access/fetch_job.h"

#include <algorithm>

#include "formats/bytes.h"

namespace cairn::formats {
namespace {

/// What was received for one more failure to be forgiven.
constexpr std::uint64_t kBytesPerFailure = 64 << 10;
/// A server may ask for this wait at most: then a viewer asks again, others fail.
constexpr std::chrono::seconds kLongestRetryAfter{30};

std::optional<std::string> take_text(ByteReader& from) {
  const auto size = from.read<std::uint32_t>();
  if (!size) return std::nullopt;
  const auto text = from.take(*size);
  if (!text) return std::nullopt;
  return std::string(reinterpret_cast<const char*>(text->data()), text->size());
}

}  // namespace

std::chrono::milliseconds retry_delay(const AccessOptions& options, unsigned failures,
                                      std::optional<std::chrono::seconds> retry_after) {
  std::chrono::milliseconds delay = options.first_delay;
  for (unsigned i = 1; i < failures && delay < options.longest_delay; ++i) delay *= 2;
  delay = std::min(delay, options.longest_delay);
  if (!retry_after) return delay;
  return std::max<std::chrono::milliseconds>(delay, std::min(*retry_after, kLongestRetryAfter));
}

bool too_many_failures(const AccessOptions& options, unsigned failures,
                       std::uint64_t received_bytes) {
  return failures >= options.attempts + received_bytes / kBytesPerFailure;
}

std::vector<std::byte> encode_front(const Validators& validators, std::uint64_t file_size_bytes,
                                    std::span<const std::byte> bytes) {
  ByteWriter to;
  for (const std::string& text : {validators.etag, validators.last_modified}) {
    to.write(static_cast<std::uint32_t>(text.size()));
    to.write_text(text);
  }
  to.write(file_size_bytes);
  to.write_bytes(bytes);
  return std::move(to).take();
}

std::optional<StoredFront> decode_front(std::span<const std::byte> bytes) {
  ByteReader from(bytes);
  const auto etag = take_text(from);
  if (!etag) return std::nullopt;
  const auto last_modified = take_text(from);
  if (!last_modified) return std::nullopt;
  const auto size = from.read<std::uint64_t>();
  StoredFront front{.validators = {*etag, *last_modified}};
  if (!size || !front.validators.any() || from.remaining() == 0 || from.remaining() > *size)
    return std::nullopt;
  front.file_size_bytes = *size;
  const auto rest = bytes.subspan(from.position());
  front.bytes = std::make_shared<const std::vector<std::byte>>(rest.begin(), rest.end());
  return front;
}

}  // namespace cairn::formats
