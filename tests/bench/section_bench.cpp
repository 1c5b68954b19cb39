// Speed and size of quantisers and node sections on synthetic columns with the statistics of a scanned
// surface: 65,536 points of a node along a Hilbert curve. Items are points.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "formats/dataset/node_section.h"
#include "formats/dataset/normal_column.h"
#include "formats/dataset/quantize.h"
#include "tests/support/columns.h"

namespace {

using namespace cairn::formats;
using cairn::tests::Bytes;

constexpr std::size_t kPoints = 65536;

/// Steps of a few hundred codes, with a long one now and then where the curve leaves the surface.
Bytes positions() {
  std::mt19937 random(1);
  std::normal_distribution<double> near(0, 170);
  std::normal_distribution<double> far(0, 3000);
  std::vector<std::uint16_t> codes(3 * kPoints);
  for (std::size_t i = 3; i < codes.size(); ++i) {
    const double step = random() % 32 == 0 ? far(random) : near(random);
    codes[i] = static_cast<std::uint16_t>(static_cast<int>(codes[i - 3] + std::lround(step)));
  }
  return cairn::tests::bytes_of(codes);
}

/// As a column of float32 x 3.
Bytes smooth_normals() {
  std::mt19937 random(2);
  std::normal_distribution<float> noise(0, 0.006f);
  std::vector<float> normals;
  normals.reserve(3 * kPoints);
  for (std::size_t i = 0; i < kPoints; ++i) {
    const float t = static_cast<float>(i) * 2e-4f;
    for (const float c : {std::cos(t), std::sin(1.7f * t), 0.8f})
      normals.push_back(c + noise(random));
  }
  return cairn::tests::bytes_of(normals);
}

std::vector<std::uint16_t> normal_codes() {
  return encode_normal_column(smooth_normals(), ScalarType::kF32);
}

Bytes normals() { return cairn::tests::bytes_of(normal_codes()); }

/// Local density, the same over about 16 points.
Bytes radii() {
  std::mt19937 random(3);
  std::vector<std::uint8_t> codes(kPoints);
  for (std::size_t i = 0; i < kPoints; ++i)
    codes[i] = i % 16 == 0 ? static_cast<std::uint8_t>(90 + random() % 48) : codes[i - 1];
  return cairn::tests::bytes_of(codes);
}

/// Groups of one to seven points.
Bytes representatives() {
  std::mt19937 random(4);
  std::vector<std::uint32_t> index(kPoints);
  for (std::size_t i = 0, left = 4; i < kPoints; ++i) {
    index[i] = i == 0 ? 0 : index[i - 1] + (left == 0 ? 1 : 0);
    left = left == 0 ? random() % 7 : left - 1;
  }
  return cairn::tests::bytes_of(index);
}

Bytes colours() {
  std::mt19937 random(5);
  std::vector<std::uint16_t> codes(3 * kPoints);
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double light =
        120 + 60 * std::sin(static_cast<double>(i) * 1e-3) + static_cast<double>(random() % 16);
    for (std::size_t c = 0; c < 3; ++c)
      codes[3 * i + c] = static_cast<std::uint16_t>(
          static_cast<unsigned>(light + 10.0 * static_cast<double>(c)) * 257);
  }
  return cairn::tests::bytes_of(codes);
}

struct Column {
  ColumnShape shape;
  Bytes bytes;
};

Column column_named(int which) {
  switch (which) {
    case 0:
      return {{ScalarType::kU16, 3, kPoints}, positions()};
    case 1:
      return {{ScalarType::kU16, 1, kPoints}, normals()};
    case 2:
      return {{ScalarType::kU8, 1, kPoints}, radii()};
    case 3:
      return {{ScalarType::kU32, 1, kPoints}, representatives()};
    default:
      return {{ScalarType::kU16, 3, kPoints}, colours()};
  }
}
constexpr const char* kColumnNames[] = {"position", "normal", "radius", "representative", "colour"};

/// Positions, normals, radii and representatives: what a node without attributes holds.
std::vector<Column> node_columns() {
  std::vector<Column> columns;
  for (int which = 0; which < 4; ++which) columns.push_back(column_named(which));
  return columns;
}

void encode_columns(benchmark::State& state, const std::vector<Column>& columns, Codec codec) {
  std::size_t size = 0;
  for (auto _ : state) {
    size = 0;
    for (const Column& column : columns) {
      const auto section = encode_section(column.bytes, column.shape, codec);
      size += section.size();
      benchmark::DoNotOptimize(section.data());
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kPoints));
  state.counters["bytes_a_point"] = static_cast<double>(size) / kPoints;
}

void decode_columns(benchmark::State& state, const std::vector<Column>& columns, Codec codec) {
  std::vector<Bytes> sections;
  for (const Column& column : columns)
    sections.push_back(encode_section(column.bytes, column.shape, codec));
  std::vector<Column> back = columns;
  for (auto _ : state)
    for (std::size_t i = 0; i < sections.size(); ++i) {
      if (decode_section(sections[i], back[i].shape, back[i].bytes))
        state.SkipWithError("a section did not decode");
      benchmark::DoNotOptimize(back[i].bytes.data());
    }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kPoints));
}

void BM_EncodeSection(benchmark::State& state) {
  const int which = static_cast<int>(state.range(0));
  state.SetLabel(kColumnNames[which]);
  encode_columns(state, {column_named(which)}, Codec::kLzo);
}
BENCHMARK(BM_EncodeSection)->DenseRange(0, 4);

void BM_DecodeSection(benchmark::State& state) {
  const int which = static_cast<int>(state.range(0));
  state.SetLabel(kColumnNames[which]);
  decode_columns(state, {column_named(which)}, Codec::kLzo);
}
BENCHMARK(BM_DecodeSection)->DenseRange(0, 4);

void BM_EncodeNode(benchmark::State& state) {
  encode_columns(state, node_columns(), static_cast<Codec>(state.range(0)));
}
BENCHMARK(BM_EncodeNode)->Arg(0)->Arg(1)->Arg(3);

void BM_DecodeNode(benchmark::State& state) {
  decode_columns(state, node_columns(), static_cast<Codec>(state.range(0)));
}
BENCHMARK(BM_DecodeNode)->Arg(0)->Arg(1)->Arg(3);

/// range(0): the span of the box; 16 bits are exact below 65,536.
void BM_QuantisePositions(benchmark::State& state, bool decode) {
  const auto span = static_cast<std::int32_t>(state.range(0));
  const PositionQuantizer quantizer({{0, 0, 0}, {span, span, span}}, 16);
  std::mt19937 random(6);
  std::vector<GridPoint> points(kPoints);
  for (GridPoint& p : points)
    for (std::int32_t& x : p)
      x = static_cast<std::int32_t>(random() % (static_cast<std::uint32_t>(span) + 1));
  std::vector<std::uint16_t> codes(3 * kPoints);
  quantizer.encode(points, codes);
  for (auto _ : state) {
    if (decode)
      quantizer.decode(codes, points);
    else
      quantizer.encode(points, codes);
    benchmark::DoNotOptimize(codes.data());
    benchmark::DoNotOptimize(points.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kPoints));
}
BENCHMARK_CAPTURE(BM_QuantisePositions, encode, false)->Arg(60'000)->Arg(9'000'000);
BENCHMARK_CAPTURE(BM_QuantisePositions, decode, true)->Arg(60'000)->Arg(9'000'000);

void BM_EncodeNormals(benchmark::State& state) {
  const auto input = smooth_normals();
  for (auto _ : state)
    benchmark::DoNotOptimize(encode_normal_column(input, ScalarType::kF32).data());
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kPoints));
}
BENCHMARK(BM_EncodeNormals);

void BM_DecodeNormals(benchmark::State& state) {
  const auto codes = normal_codes();
  for (auto _ : state)
    benchmark::DoNotOptimize(decode_normal_column(codes, ScalarType::kF32).data());
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kPoints));
}
BENCHMARK(BM_DecodeNormals);

void BM_EncodeRadii(benchmark::State& state) {
  std::mt19937 random(7);
  std::vector<float> input(kPoints);
  for (float& r : input) r = 0.01f + static_cast<float>(random() % 1000) * 1e-5f;
  const RadiusQuantizer quantizer(0.01f, 0.02f);
  std::vector<std::uint8_t> codes(kPoints);
  for (auto _ : state) {
    quantizer.encode(input, codes);
    benchmark::DoNotOptimize(codes.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kPoints));
}
BENCHMARK(BM_EncodeRadii);

}  // namespace
