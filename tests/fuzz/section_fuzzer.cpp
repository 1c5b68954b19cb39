// Hostile node sections. The first bytes of an input choose the shape and the codec. The rest is taken first as a column,
// which has to come back from its section, then as a hostile section, decoded into an allocation of exactly the column's
// size.
#include <algorithm>
#include <vector>

#include "formats/dataset/node_section.h"
#include "tests/fuzz/fuzz_target.h"

namespace cairn::fuzz {
namespace {

using namespace formats;

constexpr std::size_t kHeadBytes = 4;

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

void run(std::span<const std::byte> bytes) {
  if (bytes.size() < kHeadBytes) return;
  const auto head = [&](std::size_t i) { return std::to_integer<std::size_t>(bytes[i]); };
  const auto data = bytes.subspan(kHeadBytes);
  ColumnShape shape;
  shape.type = static_cast<ScalarType>(1 + head(0) % 10);
  shape.components = static_cast<std::uint8_t>(1 + head(1) % (head(1) < 128 ? 4 : 128));
  encode_decode_compare(data, shape, static_cast<Codec>(head(2) % 4));
  shape.count = head(3) * (head(3) % 2 == 0 ? 1 : 5);
  decode_hostile(data, shape);
}

}  // namespace cairn::fuzz
