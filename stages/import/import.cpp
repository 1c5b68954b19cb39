#include "stages/import/import.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "formats/checksum.h"
#include "formats/error.h"
#include "stages/import/campaign_schema.h"
#include "stages/import/grid_choice.h"
#include "stages/parallel.h"
#include "stages/unit_state.h"

namespace cairn::stages {

using formats::PointBlock;
using formats::PositionEncoding;
using formats::ScanInfo;

namespace {

/// One stretch of one scan: the unit of parallel reading, with a place of its own in the array.
struct Stretch {
  std::size_t scan;
  std::size_t stretch;
  std::uint64_t first_slot;
  std::uint64_t capacity;
};

/// What reading a stretch found.
struct Reading {
  std::uint64_t read = 0;
  std::uint64_t kept = 0;
  std::uint64_t no_return = 0;
  ScanBox box = {};
  std::uint64_t checksum = 0;  ///< of its records in the array
  std::uint64_t brightest =
      0;  ///< see ScanLedger; as wide as the others, so that no padding is logged
};

/// The units of import are its stretches; when all are read, the grid.
constexpr std::string_view kUnits = unit_log::kImport;

template <typename T>
std::optional<T> recalled(const Context& context, std::uint64_t unit) {
  const auto state = finished_unit(context, kUnits, unit);
  if (!state) return std::nullopt;
  T value;
  StateReader(*state).get(value);
  return value;
}

template <typename T>
void remember(const Context& context, std::uint64_t unit, const T& value) {
  finish_unit(context, kUnits, unit, StateWriter().put(value).bytes());
}

std::vector<const ScanInfo*> infos_of(const Scans& scans) {
  std::vector<const ScanInfo*> infos;
  for (const auto& scan : scans) infos.push_back(&scan->info());
  return infos;
}

std::vector<Stretch> list_stretches(const Scans& scans) {
  std::vector<Stretch> stretches;
  std::uint64_t slot = 0;
  for (std::size_t s = 0; s < scans.size(); ++s)
    for (std::size_t i = 0; i < scans[s]->stretch_count(); ++i) {
      const std::uint64_t capacity = scans[s]->stretch_capacity(i);
      stretches.push_back({s, i, slot, capacity});
      if (__builtin_add_overflow(slot, capacity, &slot))
        formats::throw_input({.what = "the scans' point counts add up to more than 2^64"});
    }
  return stretches;
}

std::size_t native_position_bytes(const Scans& scans) {
  for (const auto& scan : scans)
    if (scan->info().encoding == PositionEncoding::kFloat64) return 24;
  return 12;
}

std::array<double, 3> native_position(const std::byte* record, PositionEncoding encoding) {
  std::array<double, 3> p;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (encoding == PositionEncoding::kSteps)
      p[axis] = formats::load_le<std::int32_t>(record + 4 * axis);
    if (encoding == PositionEncoding::kFloat32)
      p[axis] = static_cast<double>(formats::load_le<float>(record + 4 * axis));
    if (encoding == PositionEncoding::kFloat64)
      p[axis] = formats::load_le<double>(record + 8 * axis);
  }
  return p;
}

/// A record of the import array; the number of its scan, if there is one, stands last.
formats::RecordLayout native_layout(const formats::Schema& schema, const Scans& scans,
                                    bool numbered) {
  formats::RecordLayout layout(schema, native_position_bytes(scans));
  if (numbered) layout.stride += sizeof(std::uint32_t);
  return layout;
}

/// The largest value of a block's colors, which are of 8 or 16 bits.
std::uint64_t brightest_of(const PointBlock& block, const formats::Schema& schema) {
  const auto color = formats::find_attribute(schema, formats::attribute_name::kColor);
  if (!color) return 0;
  const std::span<const std::byte> column(block.columns[*color].data(),
                                          block.count * schema[*color].size_bytes());
  std::uint16_t brightest = 0;
  if (schema[*color].type == formats::ScalarType::kU16)
    for (std::size_t at = 0; at < column.size(); at += 2)
      brightest = std::max(brightest, formats::load_le<std::uint16_t>(&column[at]));
  else if (schema[*color].type == formats::ScalarType::kU8)
    for (const std::byte value : column)
      brightest = std::max(brightest, std::to_integer<std::uint16_t>(value));
  return brightest;
}

Reading read_stretch(const formats::ScanReader& scan, const RecordConverter& converter,
                     ImportedPoints& points, const Stretch& stretch, const Context& context) {
  Reading reading;
  formats::RunningChecksum checksum;
  const std::size_t stride = points.stride;
  formats::ExternalArray& array = points.array;
  std::uint64_t at = stretch.first_slot * stride;
  scan.read(stretch.stretch, [&](const PointBlock& block) {
    throw_if_stopped(context);
    const std::uint64_t records = block.count + block.no_return;
    CAIRN_CHECK(records <= stretch.capacity - reading.read);
    std::byte* out = array.bytes().data() + at;
    const std::size_t kept = converter.convert(block, out);
    for (std::size_t i = 0; i < kept; ++i) {
      reading.box.add(native_position(out + i * stride, scan.info().encoding));
      if (points.numbered)
        formats::store_le(out + (i + 1) * stride - sizeof(std::uint32_t),
                          static_cast<std::uint32_t>(stretch.scan));
    }
    reading.read += records;
    reading.kept += kept;
    reading.no_return += block.no_return;
    reading.brightest = std::max(reading.brightest, brightest_of(block, scan.info().schema));
    checksum.add(std::span(out, kept * stride));
    array.release(at, kept * stride);
    at += kept * stride;
    context.progress->advance(records);
  });
  reading.checksum = checksum.value();
  return reading;
}

/// Whether the records that an earlier run read still stand in the array.
bool still_there(ImportedPoints& points, const Stretch& stretch, const Reading& reading) {
  const std::uint64_t at = stretch.first_slot * points.stride;
  const std::uint64_t size_bytes = reading.kept * points.stride;
  const std::uint64_t checksum = formats::checksum_of(points.array.bytes().subspan(at, size_bytes));
  points.array.release(at, size_bytes);
  return checksum == reading.checksum;
}

/// A worker holds a block as raw bytes, as columns and as records of `stride` bytes, and what its reader needs.
unsigned reading_workers(const Scans& scans, std::size_t stride, const Context& context) {
  std::uint64_t worker_bytes = 0;
  for (const auto& scan : scans) worker_bytes = std::max(worker_bytes, scan->read_bytes());
  return workers_within(context, worker_bytes + formats::kBlockPoints * (3 * stride + 24));
}

/// Sampling touches nearly every page of the array; they go back after stretches of this many bytes.
constexpr std::uint64_t kSampledBytes = std::uint64_t{4} << 20;
constexpr std::uint64_t kSamples = 1 << 17;

using Position = std::array<double, 3>;
using AxisSamples = std::array<std::vector<double>, 3>;

/// Calls `visit` with every k-th position of a scan.
template <typename Visit>
void visit_positions(ImportedPoints& points, std::size_t scan, PositionEncoding encoding,
                     std::uint64_t every, Visit visit) {
  std::uint64_t before = 0;
  for (const RecordRun& run : points.runs) {
    if (run.scan != scan) continue;
    std::uint64_t walked = run.first_byte;
    for (std::uint64_t i = (every - before % every) % every; i < run.count; i += every) {
      const std::uint64_t at = run.first_byte + i * points.stride;
      visit(native_position(points.array.bytes().data() + at, encoding));
      if (at - walked < kSampledBytes) continue;
      points.array.release(walked, at - walked);
      walked = at;
    }
    points.array.release(walked, run.first_byte + run.count * points.stride - walked);
    before += run.count;
  }
}

void add(AxisSamples& samples, const Position& position) {
  for (std::size_t axis = 0; axis < 3; ++axis) samples[axis].push_back(position[axis]);
}

/// The positions of every k-th point of a scan, at most about kSamples of them, sorted on each axis.
AxisSamples sample_positions(ImportedPoints& points, std::size_t scan, PositionEncoding encoding) {
  std::uint64_t total = 0;
  for (const RecordRun& run : points.runs) total += run.scan == scan ? run.count : 0;
  AxisSamples samples;
  visit_positions(points, scan, encoding, total / kSamples + 1,
                  [&](const Position& p) { add(samples, p); });
  for (auto& axis : samples) std::sort(axis.begin(), axis.end());
  return samples;
}

/// The same of the points that do not lie at `pile`, where nearly all do, and `pile` once.
AxisSamples sample_others(ImportedPoints& points, std::size_t scan, PositionEncoding encoding,
                          const Position& pile) {
  std::uint64_t others = 0;
  visit_positions(points, scan, encoding, 1,
                  [&](const Position& p) { others += p != pile ? 1 : 0; });
  const std::uint64_t every = others / kSamples + 1;
  AxisSamples samples;
  add(samples, pile);
  std::uint64_t seen = 0;
  visit_positions(points, scan, encoding, 1, [&](const Position& p) {
    if (p != pile && seen++ % every == 0) add(samples, p);
  });
  for (auto& axis : samples) std::sort(axis.begin(), axis.end());
  return samples;
}

/// The box of the middle 99 % on every axis.
ScanBox middle_of(const AxisSamples& samples) {
  ScanBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t cut = samples[axis].size() / 200;
    box.min[axis] = samples[axis][cut];
    box.max[axis] = samples[axis][samples[axis].size() - 1 - cut];
  }
  return box;
}

/// On every axis the shortest range of all distinct coordinates but 1 %, at least one: however few there are, a stray
/// one does not stretch it.
ScanBox shortest_of_distinct(AxisSamples samples) {
  ScanBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    auto& values = samples[axis];
    values.erase(std::unique(values.begin(), values.end()), values.end());
    const std::size_t left_out =
        std::min(values.size() - 1, std::max<std::size_t>(1, values.size() / 100));
    const std::size_t reach = values.size() - 1 - left_out;
    std::size_t best = 0;
    for (std::size_t first = 1; first <= left_out; ++first)
      if (values[first + reach] - values[first] < values[best + reach] - values[best]) best = first;
    box.min[axis] = values[best];
    box.max[axis] = values[best + reach];
  }
  return box;
}

/// 2^-22 of the longest side of the box of the middle 99 % of a scan's points, per axis; judged on samples,
/// since it only tells stray points from the rest. Where nearly all points are one, the others tell what detail
/// there is; where they are two, their distance. `box`, of all points of the scan, has an extent.
double float_resolution(ImportedPoints& points, std::size_t scan, const ScanInfo& info,
                        const ScanBox& box) {
  const PositionEncoding encoding = info.encoding;
  ScanBox middle = middle_of(sample_positions(points, scan, encoding));
  if (middle.min == middle.max)
    middle = shortest_of_distinct(sample_others(points, scan, encoding, middle.min));
  if (middle.min == middle.max) middle = box;
  middle = world_box(info, middle);
  const double float_digits =
      encoding == PositionEncoding::kFloat32 ? std::ldexp(1.0, -24) : std::ldexp(1.0, -50);
  double resolution = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double low = middle.min[axis], high = middle.max[axis];
    const double magnitude = std::max(std::fabs(low), std::fabs(high));
    resolution = std::max({resolution, std::ldexp(high - low, -22), magnitude * float_digits});
  }
  return resolution;
}

/// See ScanExtent::resolution.
double resolution_of(ImportedPoints& points, std::size_t scan, const ScanInfo& info,
                     const ScanBox& box) {
  // Where all points are one there is no detail to lose.
  if (box.empty() || box.min == box.max) return std::numeric_limits<double>::infinity();
  if (info.encoding != PositionEncoding::kSteps) return float_resolution(points, scan, info, box);
  const double scale = *std::min_element(info.scale.begin(), info.scale.end());
  return info.has_nominal_scale ? std::max(scale, float_resolution(points, scan, info, box))
                                : scale;
}

formats::Grid fix_grid(ImportedPoints& points, const Scans& scans,
                       const std::vector<ScanBox>& boxes, std::optional<double> accepted) {
  std::vector<ScanExtent> extents;
  for (std::size_t s = 0; s < scans.size(); ++s)
    extents.push_back({&scans[s]->info(), boxes[s], std::numeric_limits<double>::infinity()});
  if (const auto grid = common_grid(extents)) return *grid;
  // To judge them, positions are read once more.
  for (std::size_t s = 0; s < scans.size(); ++s)
    extents[s].resolution = resolution_of(points, s, scans[s]->info(), boxes[s]);
  return fitted_grid(extents, accepted);
}

/// See ScanLedger::precision.
double precision_of(const ScanInfo& info, const ScanBox& box) {
  if (info.encoding == PositionEncoding::kSteps)
    return *std::max_element(info.scale.begin(), info.scale.end());
  const int digits = info.encoding == PositionEncoding::kFloat32 ? 24 : 53;
  double farthest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    farthest = std::max({farthest, std::fabs(box.min[axis]), std::fabs(box.max[axis])});
  return farthest > 0 ? std::ldexp(1.0, std::ilogb(farthest) + 1 - digits) : 0;
}

void map_to_grid(ImportedPoints& points, const Scans& scans, const std::vector<ScanBox>& boxes) {
  for (std::size_t s = 0; s < scans.size(); ++s) {
    points.maps.emplace_back(scans[s]->info(), points.grid);
    if (boxes[s].empty()) continue;
    // The map is monotone on every axis, so the corners' images are the tight box.
    formats::GridBox& box = points.ledger[s].box;
    box.add(points.maps[s].map(boxes[s].min));
    box.add(points.maps[s].map(boxes[s].max));
    points.ledger[s].precision = precision_of(scans[s]->info(), boxes[s]);
    points.box.add(box);
  }
}

void keep_ledger(ImportedPoints& points, const Scans& scans, const std::vector<Stretch>& stretches,
                 const std::vector<Reading>& readings) {
  points.ledger.resize(scans.size());
  for (std::size_t s = 0; s < scans.size(); ++s)
    points.ledger[s].claimed = scans[s]->info().claimed_points;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const std::size_t scan = stretches[i].scan;
    points.ledger[scan].read += readings[i].read;
    points.ledger[scan].kept += readings[i].kept;
    points.ledger[scan].no_return += readings[i].no_return;
    points.ledger[scan].brightest =
        std::max(points.ledger[scan].brightest, static_cast<std::uint16_t>(readings[i].brightest));
    points.points += readings[i].kept;
    if (readings[i].kept > 0)
      points.runs.push_back({scan, stretches[i].first_slot * points.stride, readings[i].kept});
  }
}

std::vector<ScanBox> boxes_of(std::size_t scans, const std::vector<Stretch>& stretches,
                              const std::vector<Reading>& readings) {
  std::vector<ScanBox> boxes(scans);
  for (std::size_t i = 0; i < stretches.size(); ++i) boxes[stretches[i].scan].add(readings[i].box);
  return boxes;
}

/// Reads all stretches into the array; `again`: but those that an earlier run has left there.
void read_stretches(const Scans& scans, const std::vector<Stretch>& stretches, bool again,
                    const formats::RecordLayout& layout, ImportedPoints& points,
                    std::vector<Reading>& readings, const Context& context) {
  const auto infos = infos_of(scans);
  const bool wide = guessed_colors_are_wide(infos);
  std::vector<RecordConverter> converters;
  converters.reserve(infos.size());
  for (const ScanInfo* info : infos) converters.emplace_back(*info, points.schema, layout, wide);
  const auto read = [&](std::uint64_t i) {
    const Stretch& stretch = stretches[i];
    const auto known = again ? recalled<Reading>(context, i) : std::nullopt;
    if (known && still_there(points, stretch, *known)) {
      readings[i] = *known;
      return context.progress->advance(known->read);
    }
    readings[i] =
        read_stretch(*scans[stretch.scan], converters[stretch.scan], points, stretch, context);
    remember(context, i, readings[i]);
  };
  run_in_arena(reading_workers(scans, layout.stride, context),
               [&] { for_each_piece(stretches.size(), read); });
}

}  // namespace

CampaignSize campaign_size(const Scans& scans, const ImportOptions& options) {
  CampaignSize size;
  size.schema = merge_schemas(infos_of(scans), options.drop, options.keep);
  for (const Stretch& stretch : list_stretches(scans)) size.points += stretch.capacity;
  const std::uint64_t native_bytes = native_layout(size.schema, scans, options.number_scans).stride;
  size.record_bytes = native_bytes - native_position_bytes(scans) + 12;
  // No multiple of a few that a caller may form overflows either.
  if (__builtin_mul_overflow(size.points, native_bytes, &size.import_bytes) ||
      size.import_bytes > UINT64_MAX / 8)
    formats::throw_input({.what = "the scans' points need more bytes than can be counted"});
  return size;
}

ImportedPoints import_scans(const Scans& scans, const ImportOptions& options, Context& context) {
  const std::uint64_t size_bytes = campaign_size(scans, options).import_bytes;
  const auto infos = infos_of(scans);
  ImportedPoints points{.array = {},
                        .schema = merge_schemas(infos, options.drop, options.keep),
                        .native_position_bytes = native_position_bytes(scans),
                        .stride = 0,
                        .numbered = options.number_scans,
                        .runs = {},
                        .grid = {},
                        .maps = {},
                        .ledger = {},
                        .box = {},
                        .points = 0};
  const formats::RecordLayout layout = native_layout(points.schema, scans, options.number_scans);
  points.stride = layout.stride;

  const std::vector<Stretch> stretches = list_stretches(scans);
  std::vector<Reading> readings(stretches.size());
  const auto grid = recalled<formats::Grid>(context, kStageDone);
  auto found = find_array(context, "import", size_bytes);
  const bool again = found.has_value();
  context.progress->begin("import", size_bytes / layout.stride);
  if (grid && !again) {
    // The split has taken the records over: what is to be known of them is.
    for (std::size_t i = 0; i < stretches.size(); ++i) {
      const auto known = recalled<Reading>(context, i);
      if (!known) throw WorkLost{};
      readings[i] = *known;
    }
  } else {
    points.array = again ? std::move(*found) : context.make_array("import", size_bytes);
    read_stretches(scans, stretches, again, layout, points, readings, context);
  }
  keep_ledger(points, scans, stretches, readings);
  context.progress->end();
  if (points.points == 0)
    formats::throw_input({.what = "no usable point in the campaign",
                          .path = infos.empty() ? std::filesystem::path{} : infos.front()->path,
                          .found = "0 points with finite coordinates",
                          .expected = "at least one"});
  const std::vector<ScanBox> boxes = boxes_of(scans.size(), stretches, readings);
  points.grid = grid ? *grid : fix_grid(points, scans, boxes, options.resolution);
  if (!grid) remember(context, kStageDone, points.grid);
  map_to_grid(points, scans, boxes);
  return points;
}

void stream_canonical_records(const Scans& scans, const formats::Schema& schema,
                              const formats::Grid& grid, const Context& context,
                              const ScanRecordSink& sink) {
  const formats::RecordLayout native(schema, native_position_bytes(scans));
  const formats::RecordLayout canonical(schema, 12);
  const std::size_t attribute_bytes = canonical.stride - 12;
  const std::vector<Stretch> stretches = list_stretches(scans);
  const bool wide = guessed_colors_are_wide(infos_of(scans));
  const auto stream = [&](std::uint64_t i) {
    const formats::ScanReader& scan = *scans[stretches[i].scan];
    const RecordConverter converter(scan.info(), schema, native, wide);
    const formats::PositionMap map(scan.info(), grid);
    std::vector<std::byte> from, to;
    scan.read(stretches[i].stretch, [&](const PointBlock& block) {
      from.assign(block.count * native.stride, std::byte{0});
      const std::size_t kept = converter.convert(block, from.data());
      to.resize(kept * canonical.stride);
      for (std::size_t p = 0; p < kept; ++p) {
        const std::byte* source = from.data() + p * native.stride;
        const formats::GridPoint position = map.map(source);
        std::memcpy(to.data() + p * canonical.stride, position.data(), 12);
        std::memcpy(to.data() + p * canonical.stride + 12, source + native.position_size_bytes,
                    attribute_bytes);
      }
      sink(stretches[i].scan, to, canonical.stride);
    });
  };
  run_in_arena(reading_workers(scans, native.stride + canonical.stride, context),
               [&] { for_each_piece(stretches.size(), stream); });
}

}  // namespace cairn::stages
