// libFuzzer target for node sections; `scripts/sanitize.sh fuzz` runs it.
// The first bytes of an input choose the shape and the codec. The rest is taken first as a column, which
// has to come back from its section, then as a hostile section, decoded into an allocation of exactly
// the column's size.
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "formats/dataset/node_section.h"

namespace {

using namespace cairn::formats;

constexpr std::size_t kHeadBytes = 4;

void require(bool condition) {
  if (!condition) std::abort();
}

void encode_decode_compare(std::span<const std::byte> data, ColumnShape shape, Codec codec) {
  shape.count = data.size() / shape.point_bytes();
  const auto column = data.first(shape.size_bytes());
  const std::vector<std::byte> section = encode_section(column, shape, codec);
  require(section.size() <= column.size() + 2);
  std::vector<std::byte> back(column.size());
  require(!decode_section(section, shape, back).has_value());
  require(std::equal(back.begin(), back.end(), column.begin()));
}

void decode_hostile(std::span<const std::byte> section, const ColumnShape& shape) {
  std::vector<std::byte> column(shape.size_bytes());
  if (const auto error = decode_section(section, shape, column)) require(!error->what.empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size < kHeadBytes) return 0;
  const auto data = std::as_bytes(std::span(bytes, size)).subspan(kHeadBytes);
  ColumnShape shape;
  shape.type = static_cast<ScalarType>(1 + bytes[0] % 10);
  shape.components = 1 + bytes[1] % (bytes[1] < 128 ? 4 : 128);
  const auto codec = static_cast<Codec>(bytes[2] % 4);
  encode_decode_compare(data, shape, codec);
  shape.count = std::size_t{bytes[3]} * (bytes[3] % 2 == 0 ? 1 : 5);
  decode_hostile(data, shape);
  return 0;
}
