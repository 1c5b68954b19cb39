// Tiles as bytes: against the formats' specifications, the library of the codec, and published places and curves.
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <random>

#include "formats/bytes.h"
#include "formats/tiles/earth.h"
#include "formats/tiles/glb.h"
#include "formats/tiles/glb_names.h"
#include "formats/tiles/linear_color.h"
#include "formats/tiles/meshopt_stream.h"
#include "formats/tiles/tileset.h"

namespace cairn::formats {
namespace {

using Json = nlohmann::json;

TileColumn column(const char* semantic, ScalarType type, std::uint8_t components, bool normalized,
                  std::size_t count, std::mt19937& random) {
  TileColumn made{
      .semantic = semantic, .type = type, .components = components, .normalized = normalized};
  made.values.resize(count * made.stride_bytes());
  const std::size_t used = size_bytes(type) * components;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < used; ++k)
      made.values[i * made.stride_bytes() + k] = static_cast<std::byte>(random());
  if (type == ScalarType::kF32)
    for (std::size_t i = 0; i < count; ++i)
      store_le(&made.values[i * 4], static_cast<float>(i) * 0.5F);
  return made;
}

TilePoints sample(std::size_t count = 1000) {
  std::mt19937 random(7);
  TilePoints points{.count = count, .scale = {0.001, 0.002, 0.003}, .origin = {-12.5, 7, 1e5}};
  points.columns = {column("POSITION", ScalarType::kU16, 3, false, count, random),
                    column("COLOR_0", ScalarType::kU16, 3, true, count, random),
                    column("_INTENSITY", ScalarType::kU16, 1, false, count, random),
                    column("_CLASSIFICATION", ScalarType::kU8, 1, false, count, random),
                    column("_HEAT", ScalarType::kF32, 1, false, count, random)};
  return points;
}

/// The two chunks, by the layout in the specification of glTF.
std::pair<Json, std::vector<std::byte>> chunks_of(const std::vector<std::byte>& glb) {
  const auto word = [&](std::size_t at) { return load_le<std::uint32_t>(&glb.at(at)); };
  EXPECT_EQ(word(0), 0x46546C67U);
  EXPECT_EQ(word(4), 2U);
  EXPECT_EQ(word(8), glb.size());
  const std::size_t json_bytes = word(12);
  EXPECT_EQ(word(16), 0x4E4F534AU);
  EXPECT_EQ(json_bytes % 4, 0U);
  const auto* text = reinterpret_cast<const char*>(&glb[20]);
  EXPECT_EQ(word(20 + json_bytes + 4), 0x004E4942U);
  EXPECT_EQ(28 + json_bytes + word(20 + json_bytes), glb.size());
  return {Json::parse(text, text + json_bytes),
          {glb.begin() + static_cast<std::ptrdiff_t>(28 + json_bytes), glb.end()}};
}

TEST(Glb, ComesBackAsItWas) {
  const TilePoints points = sample();
  for (const auto compression : {TileCompression::kNone, TileCompression::kMeshopt}) {
    TilePoints back;
    const auto error = read_glb(write_glb(points, compression), back);
    ASSERT_FALSE(error) << error->what;
    EXPECT_TRUE(back == points);
  }
}

TEST(Glb, StreamsAreThoseOfTheLibrary) {
  const TilePoints points = sample();
  const auto [json, binary] = chunks_of(write_glb(points, TileCompression::kMeshopt));
  EXPECT_EQ(json.at("buffers").at(0).at("byteLength"), binary.size());
  EXPECT_EQ(json.at("buffers").at(1).at("extensions").at("EXT_meshopt_compression").at("fallback"),
            true);
  std::size_t plain = 0;
  for (std::size_t i = 0; i < points.columns.size(); ++i) {
    const Json& view = json.at("bufferViews").at(i);
    EXPECT_EQ(view.at("buffer"), 1);
    EXPECT_EQ(view.at("byteOffset"), plain);
    plain += view.at("byteLength").get<std::size_t>();
    const Json& packed = view.at("extensions").at("EXT_meshopt_compression");
    const std::size_t at = packed.at("byteOffset"), size = packed.at("byteLength");
    const std::size_t stride = packed.at("byteStride");
    EXPECT_EQ(at % 4, 0U);
    ASSERT_LE(at + size, binary.size());
    EXPECT_EQ(binary[at], std::byte{0xa0});
    std::vector<std::byte> values(points.count * stride);
    ASSERT_EQ(meshopt_decodeVertexBuffer(values.data(), points.count, stride,
                                         reinterpret_cast<const unsigned char*>(&binary[at]), size),
              0);
    EXPECT_TRUE(values == points.columns[i].values);
  }
  EXPECT_EQ(json.at("buffers").at(1).at("byteLength"), plain);
}

TEST(Glb, TellsPositionsAndProperties) {
  const TilePoints points = sample();
  const auto [json, binary] = chunks_of(write_glb(points, TileCompression::kNone));
  std::array<int, 3> least{65535, 65535, 65535}, greatest{};
  for (std::size_t i = 0; i < points.count; ++i)
    for (std::size_t a = 0; a < 3; ++a) {
      std::uint16_t code;
      std::memcpy(&code, &points.columns[0].values[8 * i + 2 * a], 2);
      least[a] = std::min<int>(least[a], code);
      greatest[a] = std::max<int>(greatest[a], code);
    }
  const Json& primitive = json.at("meshes").at(0).at("primitives").at(0);
  const Json& position =
      json.at("accessors").at(primitive.at("attributes").at("POSITION").get<std::size_t>());
  EXPECT_EQ(position.at("min"), Json(least));
  EXPECT_EQ(position.at("max"), Json(greatest));
  EXPECT_EQ(primitive.at("mode"), 0);
  // From z up to y up: (x, y, z) becomes (x, z, -y).
  EXPECT_EQ(json.at("nodes").at(0).at("matrix"),
            Json({0.001, 0., 0., 0., 0., 0., -0.002, 0., 0., 0.003, 0., 0., -12.5, 1e5, -7., 1.}));
  const Json& metadata = json.at("extensions").at("EXT_structural_metadata");
  const Json& properties = metadata.at("schema").at("classes").at("point").at("properties");
  EXPECT_EQ(properties.at("intensity").at("componentType"), "UINT16");
  EXPECT_EQ(properties.at("classification").at("componentType"), "UINT8");
  EXPECT_EQ(properties.at("heat").at("componentType"), "FLOAT32");
  EXPECT_EQ(metadata.at("propertyAttributes").at(0).at("properties").at("heat").at("attribute"),
            "_HEAT");
  EXPECT_TRUE(json.at("materials").at(0).at("extensions").contains("KHR_materials_unlit"));
}

TEST(Glb, DamageIsRefusedOrHarmless) {
  const TilePoints points = sample(60);
  for (const auto compression : {TileCompression::kNone, TileCompression::kMeshopt}) {
    const std::vector<std::byte> glb = write_glb(points, compression);
    TilePoints back;
    for (std::size_t size = 0; size < glb.size(); ++size)
      EXPECT_TRUE(read_glb(std::span(glb).first(size), back)) << size;
    std::mt19937 random(3);
    for (int round = 0; round < 1000; ++round) {
      std::vector<std::byte> bad = glb;
      bad[random() % bad.size()] = static_cast<std::byte>(random());
      if (!read_glb(bad, back)) {
        for (const TileColumn& read : back.columns)
          ASSERT_EQ(read.values.size(), back.count * read.stride_bytes());
      }
    }
  }
}

TEST(GlbNames, AttributesAreProperties) {
  EXPECT_EQ(semantic_of("near_infrared"), "_NEAR_INFRARED");
  EXPECT_EQ(property_of("_NEAR_INFRARED"), "near_infrared");
  EXPECT_EQ(property_of(semantic_of("2nd_echo")), "_2nd_echo");  // an identifier
}

TEST(MeshoptStream, RefusesWhatDoesNotDecode) {
  std::vector<std::byte> values(800, std::byte{5});
  std::vector<std::byte> stream = encode_meshopt(values, 8);
  std::vector<std::byte> back(800);
  EXPECT_TRUE(decode_meshopt(stream, 8, back));
  EXPECT_TRUE(back == values);
  EXPECT_FALSE(decode_meshopt(stream, 12, back));
  EXPECT_FALSE(decode_meshopt(std::span(stream).first(stream.size() - 1), 8, back));
  stream[0] = std::byte{0xa1};
  EXPECT_FALSE(decode_meshopt(stream, 8, back));
}

/// What clients show of a linear value, 0 to 255: by IEC 61966-2-1, and by the power that CesiumJS takes.
double by_srgb(std::uint16_t stored) {
  const double x = stored / 65535.0;
  return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055);
}
double by_power(std::uint16_t stored) { return 255 * std::pow(stored / 65535.0, 1 / 2.2); }

TEST(LinearColor, IsShownAsItWas) {
  const std::array any{LinearColors(8, ColorClient::kAny), LinearColors(16, ColorClient::kAny)};
  for (unsigned value = 0; value < 65536; ++value) {
    const bool narrow = value % 257 == 0;
    const double wanted = value / 257.0;
    for (const unsigned bits : narrow ? std::vector<unsigned>{8, 16} : std::vector<unsigned>{16}) {
      const std::uint16_t stored =
          any[bits == 16].of(static_cast<std::uint16_t>(bits == 8 ? value / 257 : value));
      // Screens round to 8 bits; between these, values are compared as they are.
      const auto off = [&](double seen) {
        return std::abs((bits == 8 ? std::round(seen) : seen) - wanted);
      };
      EXPECT_LE(off(by_srgb(stored)), 3) << wanted;
      EXPECT_LE(off(by_power(stored)), wanted < (bits == 8 ? 31 : 32) ? 6.1 : 3) << wanted;
      if (wanted >= 110) {
        EXPECT_NEAR(by_srgb(stored), wanted, bits == 8 ? 0.451 : 0.01);
      }
    }
  }
}

TEST(LinearColor, IsShownByCesiumAsItWasWhereItIsMadeForIt) {
  const LinearColors narrow(8, ColorClient::kCesium), wide(16, ColorClient::kCesium);
  // Below 2 of 255, linear values of 16 bits are coarse: 1 is shown as 0.
  for (unsigned value = 2; value < 256; ++value)
    EXPECT_EQ(std::round(by_power(narrow.of(static_cast<std::uint16_t>(value)))), value);
  for (unsigned value = 2 * 257; value < 65536; ++value)
    EXPECT_NEAR(by_power(wide.of(static_cast<std::uint16_t>(value))), value / 257.0, 0.5) << value;
}

TEST(LinearColor, BlackAndWhiteAreExact) {
  for (const ColorClient client : {ColorClient::kAny, ColorClient::kCesium}) {
    const LinearColors narrow(8, client), wide(16, client);
    EXPECT_EQ(narrow.of(0), 0);
    EXPECT_EQ(wide.of(0), 0);
    EXPECT_EQ(narrow.of(255), 65535);
    EXPECT_EQ(wide.of(65535), 65535);
    EXPECT_EQ(narrow.of(300), 65535);  // brighter than 8 bits tell
  }
}

Tileset small_tileset() {
  const auto tile = [](double x, double error, const char* content) {
    return Tile{.box = {.center = {x, 2, 3}, .half = {1, 2, 0.5}},
                .geometric_error = error,
                .content = content,
                .facts = {.level = 1, .points = 9, .bound = 0.25, .rms = 0.125, .spacing = 0.5}};
  };
  Tileset tileset{.geometric_error = 8, .root = tile(0, 4, "tiles/0/0.glb")};
  tileset.root.children = {tile(-1, 2, "tiles/1/0.glb"), tile(1, 1.5, "tiles/1/1.json")};
  return tileset;
}

TEST(TilesetJson, ComesBackAsItWas) {
  Tileset tileset = small_tileset(), back;
  tileset.transform = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 6378137, 1e-3, 3, 1};
  tileset.origin = {.world = {5e5, 4e6, 0.1},
                    .metres_per_unit = 0.3048,
                    .metres_per_height_unit = 1.25,
                    .crs = "x",
                    .colors_for = ColorClient::kCesium,
                    .points = 27};
  ASSERT_FALSE(read_tileset(write_tileset(tileset), back));
  EXPECT_TRUE(back == tileset);
  const Json json = Json::parse(write_tileset(tileset));
  EXPECT_EQ(json.at("asset").at("version"), "1.1");
  EXPECT_EQ(json.at("root").at("boundingVolume").at("box"),
            Json({0., 2., 3., 1., 0., 0., 0., 2., 0., 0., 0., 0.5}));
  EXPECT_EQ(json.at("root").at("children").size(), 2U);
  EXPECT_EQ(json.at("root").at("refine"), "REPLACE");
}

TEST(TilesetJson, RefusesWhatIsNone) {
  Tileset back;
  const std::string good = write_tileset(small_tileset());
  for (const char* text :
       {"", "[]", "{\"asset\":{\"version\":\"1.1\"}}", "{\"asset\":{\"version\":\"1.0\"}}"})
    EXPECT_TRUE(read_tileset(text, back)) << text;
  std::string added = good;
  added.replace(added.find("REPLACE"), 7, "ADD");
  EXPECT_TRUE(read_tileset(added, back));
  std::string deep;
  for (int i = 0; i < 100'000; ++i) deep += '[';
  EXPECT_TRUE(read_tileset(deep, back));
}

TEST(Earth, PlacesAreWherePublished) {
  // Axes of the ellipsoid, NIMA TR8350.2: a = 6378137 m, b = 6356752.3142 m.
  const auto equator = east_north_up({0, 0, 100});
  EXPECT_DOUBLE_EQ(equator[12], 6378237);
  EXPECT_EQ((std::array{equator[1], equator[6], equator[8]}), (std::array{1., 1., 1.}));
  const auto pole = east_north_up({0, 90, 0});
  EXPECT_NEAR(pole[14], 6356752.3142, 1e-4);
  // Example of EPSG guidance note 7-2 (method 9602): 53 48'33.82"N, 2 07'46.38"E, 73 m.
  const auto sea = east_north_up({2 + 7 / 60. + 46.38 / 3600, 53 + 48 / 60. + 33.82 / 3600, 73.0});
  EXPECT_NEAR(sea[12], 3771793.97, 0.02);
  EXPECT_NEAR(sea[13], 140253.34, 0.02);
  EXPECT_NEAR(sea[14], 5124304.35, 0.02);
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b) {
      double dot = 0;
      for (std::size_t i = 0; i < 3; ++i) dot += sea[4 * a + i] * sea[4 * b + i];
      EXPECT_NEAR(dot, a == b ? 1 : 0, 1e-15);
    }
}

}  // namespace
}  // namespace cairn::formats
