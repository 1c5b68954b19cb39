#include "viewer/picture.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "formats/error.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace cairn::viewer {
namespace {

Picture noise(std::uint32_t width, std::uint32_t height) {
  std::mt19937 random(width * 31 + height);
  Picture picture{.size = {width, height}, .rgb = {}};
  picture.rgb.resize(std::size_t{3} * width * height);
  for (auto& byte : picture.rgb) byte = static_cast<std::uint8_t>(random());
  return picture;
}

formats::ErrorKind kind_of_reading(const std::filesystem::path& path) {
  try {
    read_png(path);
  } catch (const formats::Error& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
    return error.kind();
  }
  return formats::ErrorKind{};
}

std::size_t entries(const test::TemporaryFolder& folder) {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path()))
    ++count;
  return count;
}

TEST(Picture, ComesBackAsItWasWritten) {
  const test::TemporaryFolder folder;
  for (const auto& [width, height] : {std::pair{1u, 1u}, {7u, 3u}, {640u, 360u}}) {
    const Picture picture = noise(width, height);
    write_png(picture, folder / "a.png");
    EXPECT_EQ(read_png(folder / "a.png"), picture);
  }
  EXPECT_EQ(entries(folder), 1u) << "nothing is left beside the picture";
}

// Offsets by the PNG specification: signature, then the chunk IHDR.
TEST(Picture, IsAnEightBitRgbPng) {
  const test::TemporaryFolder folder;
  write_png(noise(300, 5), folder / "a.png");
  const std::string bytes = test::read_text(folder / "a.png");
  EXPECT_EQ(bytes.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(bytes.substr(8, 8), std::string("\0\0\0\x0dIHDR", 8));
  EXPECT_EQ(bytes.substr(16, 8), std::string("\0\0\x01\x2c\0\0\0\x05", 8));
  EXPECT_EQ(bytes.substr(24, 5), std::string("\x08\x02\0\0\0", 5)) << "8 bits, RGB, not interlaced";
}

// Python decodes it with zlib alone: rows begin with the number of their filter.
TEST(Picture, HasThePixelsThatAnotherReaderFinds) {
  const test::TemporaryFolder folder;
  const Picture picture = noise(20, 9);
  write_png(picture, folder / "a.png");
  const auto script = folder.write("read.py", std::string_view(R"(
import struct, sys, zlib
data, at, packed = open(sys.argv[1], 'rb').read(), 8, b''
while at < len(data):
    size, kind = struct.unpack('>I4s', data[at:at + 8])
    body = data[at + 8:at + 8 + size]
    assert zlib.crc32(kind + body) == struct.unpack('>I', data[at + 8 + size:at + 12 + size])[0]
    packed += body if kind == b'IDAT' else b''
    at += 12 + size
raw, width, height = zlib.decompress(packed), 20, 9
def paeth(a, b, c):
    p = a + b - c
    return min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
above = [0] * (3 * width)
for row in range(height):
    line = raw[row * (3 * width + 1):(row + 1) * (3 * width + 1)]
    out = []
    for i, value in enumerate(line[1:]):
        a, b, c = (out[i - 3] if i > 2 else 0), above[i], (above[i - 3] if i > 2 else 0)
        out.append((value + [0, a, b, (a + b) // 2, paeth(a, b, c)][line[0]]) % 256)
    print(bytes(out).hex())
    above = out
)"));
  std::string expected;
  for (std::size_t i = 0; i < picture.rgb.size(); ++i) {
    expected += "0123456789abcdef"[picture.rgb[i] >> 4];
    expected += "0123456789abcdef"[picture.rgb[i] & 15];
    if ((i + 1) % 60 == 0) expected += '\n';
  }
  const auto run =
      test::run_program("/usr/bin/env", {"python3", script.string(), (folder / "a.png").string()});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, expected);
}

TEST(Picture, RefusesADamagedFile) {
  const test::TemporaryFolder folder;
  write_png(noise(40, 30), folder / "a.png");
  const std::string good = test::read_text(folder / "a.png");
  for (std::size_t length = 0; length < good.size(); length += 1 + length / 3) {
    const auto path = folder.write("short.png", std::string_view(good).substr(0, length));
    EXPECT_EQ(kind_of_reading(path), formats::ErrorKind::kInput) << "first " << length << " bytes";
  }
  std::string bad = good;
  bad[good.size() / 2] = static_cast<char>(bad[good.size() / 2] ^ 4);
  EXPECT_EQ(kind_of_reading(folder.write("bad.png", std::string_view(bad))),
            formats::ErrorKind::kInput);
  EXPECT_EQ(kind_of_reading(folder.write("text.png", std::string_view("not a picture"))),
            formats::ErrorKind::kInput);
}

// A valid header of 16384 x 16384 pixels before a few bytes may not take 805 MB.
TEST(Picture, RefusesAFileThatPromisesMoreThanItCanHold) {
  const test::TemporaryFolder folder;
  const std::string header("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\x40\0\0\0\x40\0\x08\x02\0\0\0", 29);
  const std::string rest("\x26\xaa\x87\xd3\0\0\0\0IDAT\x35\xaf\x06\x1e\0\0\0\0IEND\xae\x42\x60\x82",
                         28);
  try {
    read_png(folder.write("huge.png", std::string_view(header + rest)));
    FAIL() << "read what is not there";
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.parts().found, "a file that ends too early");
  }
}

TEST(Picture, NamesThePathThatCannotBeWrittenOrRead) {
  const test::TemporaryFolder folder;
  try {
    write_png(noise(2, 2), folder / "none/a.png");
    FAIL() << "written into a folder that is not there";
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kSystem);
    EXPECT_NE(std::string(error.what()).find("none"), std::string::npos);
  }
  EXPECT_EQ(kind_of_reading(folder / "none.png"), formats::ErrorKind::kSystem);
}

TEST(Picture, ReplacesOneThatIsThere) {
  const test::TemporaryFolder folder;
  write_png(noise(9, 9), folder / "a.png");
  write_png(noise(4, 5), folder / "a.png");
  EXPECT_EQ(read_png(folder / "a.png"), noise(4, 5));
}

}  // namespace
}  // namespace cairn::viewer
