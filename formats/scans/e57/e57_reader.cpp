#include "formats/scans/e57/e57_reader.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/scans/crs.h"
#include "formats/scans/e57/e57_document.h"
#include "formats/scans/e57/packets.h"
#include "formats/scans/e57/page_file.h"
#include "formats/scans/e57/record_decoder.h"
#include "formats/scans/e57/record_plan.h"
#include "formats/scans/resize_block.h"

namespace cairn::formats {
namespace {

constexpr std::uint64_t kStretchRecords = 4 * kBlockPoints;

/// Whether the scan's frame is that of its sensor. A pose that moves nothing tells no more than none: merged and
/// georeferenced clouds have it too.
bool is_of_station(const E57Scan& scan, const E57Plan& plan) {
  const auto is_grid = [](const E57Field& field) {
    return field.name == "rowIndex" || field.name == "columnIndex";
  };
  return plan.is_spherical || (scan.pose && *scan.pose != Pose{}) ||
         std::ranges::any_of(scan.fields, is_grid);
}

class E57Reader final : public ScanReader {
 public:
  /// `part` is empty for the only scan of a file, `places` of all its scans.
  E57Reader(std::shared_ptr<const PageFile> file, E57Scan scan, std::string part,
            bool allow_truncated, E57SectionPlaces& places)
      : file_(std::move(file)) {
    const E57Header& header = file_->header();
    info_.path = file_->path();
    info_.part = std::move(part);
    info_.format = fmt::format("E57 {}.{}", header.version_major, header.version_minor);
    auto plan = plan_records(scan, info_);
    if (!plan)
      throw_input({.what = "the points have no position",
                   .path = file_->path(),
                   .found = info_.part,
                   .expected = "cartesianX, Y and Z, or sphericalRange, Azimuth and Elevation"});
    info_.pose = scan.pose;
    const auto& limits = scan.intensity_limits;
    if (limits && std::isfinite((*limits)[1] - (*limits)[0]) && (*limits)[0] < (*limits)[1])
      info_.intensity_limits = limits;
    if (is_of_station(scan, *plan)) info_.sensor = Vector3{};
    section_ =
        std::make_unique<E57Section>(*file_, scan, used_fields(*plan),
                                     E57Walk{.stretch_records = kStretchRecords,
                                             .where = info_.part.empty() ? "the scan" : info_.part,
                                             .allow_truncated = allow_truncated},
                                     places);
    info_.claimed_points = scan.records;
    info_.present_points = section_->records();
    records_ = {std::move(scan.fields), std::move(*plan), info_.schema, info_.encoding};
  }

  void set_crs(const std::vector<VariableLengthRecord>& crs) { info_.crs = crs; }

  std::size_t stretch_count() const override {
    return static_cast<std::size_t>((info_.present_points + kStretchRecords - 1) / kStretchRecords);
  }

  std::uint64_t stretch_capacity(std::size_t stretch) const override {
    CAIRN_CHECK(stretch < stretch_count());
    return std::min(kStretchRecords, info_.present_points - stretch * kStretchRecords);
  }

  std::uint64_t read_bytes() const override {
    return StreamReader::memory_bytes(*file_, *section_) + RecordDecoder::kMemoryBytes;
  }

  void read(std::size_t stretch, const BlockSink& sink) const override {
    constexpr std::size_t kPositionBytes = 3 * sizeof(double);
    const std::uint64_t capacity = stretch_capacity(stretch);
    const std::size_t block_records =
        block_points_for(RecordLayout(info_.schema, kPositionBytes).stride);
    StreamReader streams(*file_, *section_, stretch);
    RecordDecoder decoder(records_, *section_, streams);
    PointBlock block;
    for (std::uint64_t done = 0; done < capacity;) {
      const auto count =
          static_cast<std::size_t>(std::min<std::uint64_t>(block_records, capacity - done));
      decoder.decode(stretch * kStretchRecords + done, count, block);
      sink(block);
      done += count;
    }
  }

 private:
  std::shared_ptr<const PageFile> file_;
  std::unique_ptr<const E57Section> section_;
  E57Records records_;
};

}  // namespace

std::vector<std::unique_ptr<ScanReader>> open_e57(const std::filesystem::path& path,
                                                  const ScanOptions& options) {
  const auto file = std::make_shared<const PageFile>(path, options.allow_truncated);
  E57Document document = read_e57_document(*file);
  if (document.scans.empty())
    throw_input(
        {.what = "the E57 file holds no scan",
         .path = path,
         .offset = file->header().xml_offset,
         .found = document.images == 1 ? "1 image" : fmt::format("{} images", document.images),
         .expected = "a scan in data3D"});
  const auto crs = crs_records(document.coordinate_metadata);
  E57SectionPlaces places;
  std::vector<std::unique_ptr<ScanReader>> readers;
  for (E57Scan& scan : document.scans) {
    std::string part =
        document.scans.size() > 1 ? fmt::format("scan {}", readers.size() + 1) : std::string();
    auto reader = std::make_unique<E57Reader>(file, std::move(scan), std::move(part),
                                              options.allow_truncated, places);
    if (crs) reader->set_crs(*crs);
    readers.push_back(std::move(reader));
  }
  return readers;
}

bool begins_e57(std::string_view beginning) { return beginning.starts_with("ASTM-E57"); }

}  // namespace cairn::formats
