#include <algorithm>
#include <array>
#include <string>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/lower_case.h"
#include "formats/random_access_file.h"
#include "formats/scans/e57/e57_reader.h"
#include "formats/scans/las_reader.h"
#include "formats/scans/laz/laz_reader.h"
#include "formats/scans/pcd_reader.h"
#include "formats/scans/ply_reader.h"
#include "formats/scans/posed_scan.h"
#include "formats/scans/ptx_reader.h"
#include "formats/scans/scan_reader.h"
#include "formats/scans/text_reader.h"

namespace cairn::formats {
namespace {

// Enough for what tells the formats apart: the header of a PTX scan is the longest.
constexpr std::size_t kBeginningBytes = 4096;
constexpr std::size_t kShownBytes = 16;

std::string first_bytes(const std::filesystem::path& path) {
  const RandomAccessFile file(path);
  std::array<std::byte, kBeginningBytes> bytes{};
  const std::size_t size = file.read_at_most(0, bytes);
  return {reinterpret_cast<const char*>(bytes.data()), size};
}

/// The beginning of a file, fit for a message.
std::string describe(const std::string& beginning, const std::filesystem::path& path) {
  const std::string magic = beginning.substr(0, kShownBytes);
  if (magic.empty()) return "an empty file";
  std::string shown;
  for (const char c : magic) shown += c >= 0x20 && c < 0x7f ? c : '.';
  return fmt::format("suffix \"{}\", first bytes \"{}\"", path.extension().string(), shown);
}

bool begins_ply(const std::string& magic) {
  return magic.starts_with("ply") && magic.size() > 3 &&
         (magic[3] == '\n' || magic[3] == '\r' || magic[3] == ' ' || magic[3] == '\t');
}

bool is_compressed(const std::filesystem::path& path) {
  return read_las_header(RandomAccessFile(path)).compressed;
}

using Readers = std::vector<std::unique_ptr<ScanReader>>;

template <typename Reader>
Readers open_one(const std::filesystem::path& path, const ScanOptions& options) {
  Readers readers;
  readers.push_back(std::make_unique<Reader>(path, options));
  return readers;
}

bool has_suffix(const std::filesystem::path& path,
                std::initializer_list<std::string_view> suffixes) {
  const std::string suffix = lower_suffix(path);
  return std::find(suffixes.begin(), suffixes.end(), suffix) != suffixes.end();
}

/// Formats that have a mark of their own: without it, numbers in such a file are not its points.
bool has_marked_suffix(const std::filesystem::path& path) {
  return has_suffix(path, {".las", ".laz", ".ply", ".pcd", ".e57"});
}

// The content decides: suffixes are often wrong, and a wrong one costs nothing. A text that does not look
// like points is opened by its suffix, for a message that tells what is wrong with it.
Readers open_unplaced(const std::filesystem::path& path, const ScanOptions& options) {
  const std::string magic = first_bytes(path);
  if (magic.starts_with("LASF"))
    return is_compressed(path) ? open_one<LazReader>(path, options)
                               : open_one<LasReader>(path, options);
  if (begins_e57(magic)) return open_e57(path, options);
  if (begins_ply(magic)) return open_one<PlyReader>(path, options);
  if (begins_pcd(magic) || has_suffix(path, {".pcd"})) return open_one<PcdReader>(path, options);
  if (begins_ptx(magic) || has_suffix(path, {".ptx"})) return open_ptx(path, options);
  const bool text = has_suffix(path, {".xyz", ".txt", ".csv", ".asc", ".pts"}) ||
                    (begins_with_rows(magic) && !has_marked_suffix(path));
  if (text && !magic.empty()) return open_one<TextReader>(path, options);
  throw_input({.what = "not a scan of a known format",
               .path = path,
               .offset = 0,
               .found = describe(magic, path),
               .expected = "a LAS, LAZ, E57, PLY, PCD, PTX, PTS or XYZ file"});
}

}  // namespace

Readers open_scans(const std::filesystem::path& path, const ScanOptions& options) {
  Readers readers = open_unplaced(path, options);
  if (options.pose && readers.size() != 1)
    throw_usage(fmt::format("one pose is given for the {} scans of {}", readers.size(),
                            path.filename().string()));
  for (auto& reader : readers) {
    const std::optional<Pose> pose = options.pose ? options.pose : reader->info().pose;
    if (pose && *pose != Pose{}) reader = place_scan(std::move(reader), *pose);
  }
  return readers;
}

}  // namespace cairn::formats
