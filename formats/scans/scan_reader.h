// The interface of all scan readers. A reader turns bytes into blocks of points; it knows no threads,
// but its stretches may be read by several threads at a time (`read` is const and keeps no state).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/point_block.h"
#include "formats/scans/pose.h"
#include "formats/schema.h"

namespace cairn::formats {

/// A variable length record of a LAS file, kept as it was (here: those that tell the CRS).
struct VariableLengthRecord {
  std::string user_id;
  std::uint16_t record_id = 0;
  std::string description;
  std::vector<std::byte> data;
  friend bool operator==(const VariableLengthRecord&, const VariableLengthRecord&) = default;
};

/// What a LAS file tells of one of its extra bytes beside name and type. Values stay as they are stored: what they mean is
/// offset + scale * value. Scale, offset and no-data are of single values only, not of pairs and triples.
struct AttributeDetails {
  std::string attribute;  ///< its name in the schema
  std::string name;       ///< in the file
  std::string description;
  std::optional<double> scale;
  std::optional<double> offset;
  /// The stored value that stands for none: 64 bits of an unsigned or signed integer or of a double, as the type is.
  std::optional<std::uint64_t> no_data;
  friend bool operator==(const AttributeDetails&, const AttributeDetails&) = default;
};

struct ScanInfo {
  std::filesystem::path path;
  std::string part;    ///< which scan of a file that holds several: "scan 2"; else empty
  std::string format;  ///< for people: "LAS 1.2, point format 3", "PLY ascii"
  PositionEncoding encoding = PositionEncoding::kFloat64;
  std::array<double, 3> scale{1, 1, 1};   ///< kSteps only; finite and > 0
  std::array<double, 3> offset{0, 0, 0};  ///< kSteps only; finite
  /// kSteps only: whether the scale is a way to store numbers, as in E57, where writers divide a scan's box by what an
  /// integer holds, and no promise of such detail, as in LAS.
  bool has_nominal_scale = false;
  Schema schema;
  /// Whether the values alone tell how wide the colours are, as in texts: those of 8 bits may be dark ones of 16.
  bool guesses_color_width = false;
  std::uint64_t claimed_points = 0;  ///< what the header says
  std::uint64_t present_points = 0;  ///< records that the file has room for, at most claimed_points
  /// Records that a LAS file has room for behind those that its header counts, as a scanner leaves it that fails before it
  /// has counted. They are not read.
  std::uint64_t uncounted_records = 0;
  std::vector<VariableLengthRecord> crs;
  std::vector<AttributeDetails> details;  ///< at most one an attribute
  /// Least and greatest intensity that E57 tells, finite and apart: what the sensor can tell, or what the scan holds.
  std::optional<std::array<double, 2>> intensity_limits;
  std::optional<Pose> pose;  ///< of the scan's frame in the world, as the file tells it
  /// Where the sensor stood, in the frame of the points that are handed out.
  std::optional<Vector3> sensor;

  /// The file, and the scan in it, for messages and reports.
  std::string name() const {
    return part.empty() ? path.filename().string() : path.filename().string() + ", " + part;
  }
};

struct ScanOptions {
  /// Keep the whole records of a file that ends early, instead of refusing it.
  bool allow_truncated = false;
  std::optional<Pose> pose = {};  ///< instead of what the file tells
  /// Names for the columns of a text (XYZ, TXT, CSV, PTS) instead of what it tells; "_" leaves one out. Empty: none.
  std::vector<std::string> columns = {};
};

/// Called with consecutive blocks of a stretch. May throw to stop reading.
using BlockSink = std::function<void(const PointBlock&)>;

class ScanReader {
 public:
  virtual ~ScanReader() = default;

  const ScanInfo& info() const { return info_; }

  /// Where the sensor stood, told by another file; in the frame of the points that are handed out.
  void set_sensor(const Vector3& sensor) { info_.sensor = sensor; }

  /// Independent stretches of the scan, in file order.
  virtual std::size_t stretch_count() const = 0;

  /// An upper bound of the points in a stretch, checked against the file's size; the bounds of all
  /// stretches add up to info().present_points.
  virtual std::uint64_t stretch_capacity(std::size_t stretch) const = 0;

  /// Memory that one call of `read` may hold beside its blocks, that of a worker process included.
  virtual std::uint64_t read_bytes() const { return 0; }

  /// Streams the points of one stretch, in file order. Throws Error (kInput) where the bytes are not
  /// what the header promised; for a text file cut short under `allow_truncated` it ends early.
  virtual void read(std::size_t stretch, const BlockSink& sink) const = 0;

 protected:
  ScanInfo info_;  ///< filled by the constructor of the reader
};

/// Opens the scans of a file, told by its content and suffix, each placed in the world by its pose. Throws
/// Error: kInput for what cannot be read, naming file, offset, found and expected; kSystem if the file
/// cannot be opened; kUsage for one pose given to a file of several scans.
std::vector<std::unique_ptr<ScanReader>> open_scans(const std::filesystem::path& path,
                                                    const ScanOptions& options);

}  // namespace cairn::formats
