// PNG by libpng's simplified interface, in memory: the file is written by PartFile and read by RandomAccessFile, whose
// errors name it.
#include "viewer/picture.h"

#include <png.h>

#include <cstddef>
#include <span>
#include <string>

#include "formats/error.h"
#include "formats/part_file.h"
#include "formats/random_access_file.h"

namespace cairn::viewer {
namespace {

constexpr std::uint32_t kMaxSide = PictureSize::kMaxSide;
constexpr std::uint64_t kMaxFileBytes = std::uint64_t{4} * kMaxSide * kMaxSide;
/// Deflate makes nothing shorter than by this factor: a file that promises more is not worth the memory.
constexpr std::uint64_t kMaxCompression = 1032;

std::uint64_t rgb_bytes(std::uint64_t width, std::uint64_t height) { return 3 * width * height; }

/// What libpng holds for one picture.
struct PngImage {
  png_image image{};

  PngImage() { image.version = PNG_IMAGE_VERSION; }
  ~PngImage() { png_image_free(&image); }
  PngImage(const PngImage&) = delete;
  PngImage& operator=(const PngImage&) = delete;
};

[[noreturn]] void refuse(const std::filesystem::path& path, std::string found) {
  formats::throw_input({.what = "not a PNG picture that can be read",
                        .path = path,
                        .found = std::move(found),
                        .expected = "an undamaged PNG of 8-bit RGB, at most 16384 pixels a side"});
}

std::vector<std::byte> bytes_of(const std::filesystem::path& path) {
  const formats::RandomAccessFile file(path);
  if (file.size_bytes() > kMaxFileBytes) refuse(path, std::to_string(file.size_bytes()) + " bytes");
  std::vector<std::byte> bytes(file.size_bytes());
  file.read_exactly(0, bytes);
  return bytes;
}

/// The chunk that ends every PNG; libpng is done before it comes to it.
bool ends_as_png(std::span<const std::byte> bytes) {
  constexpr unsigned char kEnd[] = {0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82};
  const auto end = std::as_bytes(std::span(kEnd));
  if (bytes.size() < end.size()) return false;
  const auto last = bytes.last(end.size());
  for (std::size_t i = 0; i < end.size(); ++i)
    if (last[i] != end[i]) return false;
  return true;
}

}  // namespace

void write_png(const Picture& picture, const std::filesystem::path& path) {
  const auto [width, height] = picture.size;
  CAIRN_CHECK(width > 0 && height > 0 && width <= kMaxSide && height <= kMaxSide);
  CAIRN_CHECK(picture.rgb.size() == rgb_bytes(width, height));
  PngImage png;
  png.image.width = width;
  png.image.height = height;
  png.image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png.image);
  std::vector<std::byte> bytes(size);
  if (png_image_write_to_memory(&png.image, bytes.data(), &size, 0, picture.rgb.data(), 0,
                                nullptr) == 0)
    throw formats::Error(
        formats::ErrorKind::kSystem,
        {.what = "cannot compress the picture", .path = path, .found = png.image.message});
  formats::PartFile part(path, true);
  part.file().append(std::span(bytes).first(size));
  part.publish();
}

Picture read_png(const std::filesystem::path& path) {
  const std::vector<std::byte> bytes = bytes_of(path);
  PngImage png;
  if (png_image_begin_read_from_memory(&png.image, bytes.data(), bytes.size()) == 0)
    refuse(path, png.image.message);
  const auto [width, height] = PictureSize{png.image.width, png.image.height};
  if (png.image.format != PNG_FORMAT_RGB) refuse(path, "another kind of pixels");
  if (width > kMaxSide || height > kMaxSide)
    refuse(path, std::to_string(width) + " x " + std::to_string(height) + " pixels");
  if (rgb_bytes(width, height) / kMaxCompression > bytes.size() || !ends_as_png(bytes))
    refuse(path, "a file that ends too early");
  Picture picture{.size = {width, height}, .rgb = {}};
  picture.rgb.resize(rgb_bytes(width, height));
  if (png_image_finish_read(&png.image, nullptr, picture.rgb.data(), 0, nullptr) == 0)
    refuse(path, png.image.message);
  return picture;
}

}  // namespace cairn::viewer
