#include "stages/simulate/scanner.h"

#include <tbb/parallel_pipeline.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/scans/resize_block.h"
#include "stages/parallel.h"
#include "stages/simulate/angles.h"
#include "stages/simulate/ray_caster.h"

namespace cairn::stages {
namespace {

using formats::PointBlock;
using formats::ScanInfo;

/// Rays of one piece of work, whatever the number of threads.
constexpr std::uint64_t kPieceRays = 16384;
static_assert(kPieceRays <= formats::kBlockPoints);
/// Enough to estimate the share of hits.
constexpr double kCoarseRays = 20000;

constexpr std::size_t kNormal = 0, kIntensity = 1, kColor = 2;  // in the schema

/// What the scanner measured of a hit, in the station's frame.
struct Echo {
  double range;
  Vector3 direction;
  Vector3 normal;
  double incidence_cosine;
  Rgb color;
};

class StationScan {
 public:
  StationScan(const std::vector<SceneObject>& objects, const Station& station, ScanFrame frame,
              const ScanInfo& description)
      : station_(station),
        frame_(frame),
        description_(description),
        pose_(station.pose()),
        to_station_(formats::transposed(pose_.linear)),
        caster_(objects, station.position) {
    for (std::uint64_t row = 0; row < station.raster.rows; ++row)
      elevations_.push_back(sine_cosine(station.raster.elevation(row)));
  }

  /// The hits of the rays from `first` on.
  std::unique_ptr<PointBlock> scan(std::uint64_t first, std::uint64_t count) const {
    std::vector<Echo> echoes;
    echoes.reserve(count);
    const std::uint64_t rows = station_.raster.rows;
    SineCosine azimuth{};
    for (std::uint64_t ray = first; ray < first + count; ++ray) {
      const std::uint64_t column = ray / rows, row = ray % rows;
      if (ray == first || row == 0) azimuth = sine_cosine(station_.raster.azimuth(column));
      const SineCosine& elevation = elevations_[row];
      measure({elevation.cosine * azimuth.cosine, elevation.cosine * azimuth.sine, elevation.sine},
              echoes);
    }
    auto block = std::make_unique<PointBlock>();
    formats::resize_block(description_.schema, description_.encoding, echoes.size(), *block);
    for (std::size_t i = 0; i < echoes.size(); ++i) record(echoes[i], i, *block);
    return block;
  }

 private:
  void measure(const Vector3& direction, std::vector<Echo>& echoes) const {
    const Vector3 in_world = formats::multiply(pose_.linear, direction);
    const auto hit = caster_.cast(in_world, station_.max_range);
    if (!hit) return;
    echoes.push_back({hit->distance, direction, formats::multiply(to_station_, hit->normal),
                      std::clamp(-dot(hit->normal, in_world), 0.0, 1.0), hit->color});
  }

  void record(const Echo& echo, std::size_t i, PointBlock& block) const {
    Vector3 point = echo.direction * echo.range;
    Vector3 normal = echo.normal;
    if (frame_ == ScanFrame::kWorld) {
      point = formats::place(pose_, point);
      normal = formats::multiply(pose_.linear, normal);
    }
    if (description_.encoding == formats::PositionEncoding::kSteps)
      for (std::size_t axis = 0; axis < 3; ++axis)
        block.steps[i][axis] = static_cast<std::int32_t>(
            std::lround((point[axis] - description_.offset[axis]) / description_.scale[axis]));
    else
      block.world[i] = point;
    for (std::size_t axis = 0; axis < 3; ++axis)
      formats::store_le(block.columns[kNormal].data() + (3 * i + axis) * sizeof(float),
                        static_cast<float>(normal[axis]));
    formats::store_le(block.columns[kIntensity].data() + i * sizeof(std::uint16_t),
                      static_cast<std::uint16_t>(std::lround(65535 * echo.incidence_cosine)));
    for (std::size_t channel = 0; channel < 3; ++channel)
      block.columns[kColor][3 * i + channel] = std::byte{echo.color[channel]};
  }

  const Station& station_;
  ScanFrame frame_;
  const ScanInfo& description_;
  formats::Pose pose_;
  std::array<Vector3, 3> to_station_;  ///< rotation from world axes to the station's
  RayCaster caster_;
  std::vector<SineCosine> elevations_;
};

Raster scaled(const Raster& raster, double factor) {
  const auto count = [&](std::uint64_t cells) {
    return static_cast<std::uint64_t>(
        std::max(1.0, std::round(static_cast<double>(cells) * factor)));
  };
  Raster result = raster;
  result.columns = count(raster.columns);
  result.rows = count(raster.rows);
  return result;
}

/// How many points a station will give, from a coarse scan.
double estimated_points(const Context& context, const std::vector<SceneObject>& objects,
                        const Station& station) {
  Station coarse = station;
  const auto rays = static_cast<double>(station.raster.rays());
  coarse.raster = scaled(station.raster, std::min(1.0, std::sqrt(kCoarseRays / rays)));
  Context quiet = context;
  quiet.progress = nullptr;
  const std::uint64_t hits =
      scan_station(quiet, objects, coarse, ScanFrame::kSensor,
                   describe_station(coarse, ScanFrame::kSensor, false), [](const PointBlock&) {});
  return rays * static_cast<double>(hits) / static_cast<double>(coarse.raster.rays());
}

/// A power of ten that counts `reach` in an int32.
double step_for(double reach) {
  double step = 1e-5;
  while (reach / step > 2e9) step *= 10;
  return step;
}

}  // namespace

ScanInfo describe_station(const Station& station, ScanFrame frame, bool steps) {
  using formats::ReduceRule;
  using formats::ScalarType;
  ScanInfo info;
  info.format = "simulated";
  info.schema = {
      {std::string(formats::attribute_name::kNormal), ScalarType::kF32, 3, ReduceRule::kNormal},
      {std::string(formats::attribute_name::kIntensity), ScalarType::kU16, 1, ReduceRule::kMean},
      {std::string(formats::attribute_name::kColor), ScalarType::kU8, 3, ReduceRule::kMean}};
  info.claimed_points = info.present_points = station.raster.rays();
  if (!steps) return info;
  info.encoding = formats::PositionEncoding::kSteps;
  info.scale.fill(step_for(station.max_range + 1));
  if (frame == ScanFrame::kWorld)
    for (std::size_t axis = 0; axis < 3; ++axis)
      info.offset[axis] = std::round(station.position[axis]);
  return info;
}

std::uint64_t scan_station(const Context& context, const std::vector<SceneObject>& objects,
                           const Station& station, ScanFrame frame, const ScanInfo& description,
                           const formats::BlockSink& sink) {
  std::uint64_t next = 0, points = 0;
  const std::uint64_t rays = station.raster.rays();
  const unsigned threads = std::max(1U, context.threads);
  run_in_arena(threads, [&] {
    const StationScan scan(objects, station, frame, description);
    using Block = std::shared_ptr<PointBlock>;
    tbb::parallel_pipeline(std::size_t{4} * threads,
                           tbb::make_filter<void, std::uint64_t>(tbb::filter_mode::serial_in_order,
                                                                 [&](tbb::flow_control& flow) {
                                                                   if (next >= rays) flow.stop();
                                                                   const std::uint64_t first = next;
                                                                   next += kPieceRays;
                                                                   return first;
                                                                 }) &
                               tbb::make_filter<std::uint64_t, Block>(
                                   tbb::filter_mode::parallel,
                                   [&](std::uint64_t first) -> Block {
                                     throw_if_stopped(context);
                                     const std::uint64_t count = std::min(kPieceRays, rays - first);
                                     Block block = scan.scan(first, count);
                                     if (context.progress != nullptr)
                                       context.progress->advance(count);
                                     return block;
                                   }) &
                               tbb::make_filter<Block, void>(tbb::filter_mode::serial_in_order,
                                                             [&](const Block& block) {
                                                               points += block->count;
                                                               if (block->count > 0) sink(*block);
                                                             }));
  });
  return points;
}

void scale_to_points(const Context& context, std::uint64_t points, Scene& scene) {
  double expected = 0;
  for (const Station& station : scene.stations)
    expected += estimated_points(context, scene.objects, station);
  if (expected == 0) formats::throw_usage("the scene has nothing that a ray hits");
  const double factor = std::sqrt(static_cast<double>(points) / expected);
  for (Station& station : scene.stations) {
    station.raster = scaled(station.raster, factor);
    if (std::max(station.raster.columns, station.raster.rows) > kMostCells)
      formats::throw_usage("so many points would take more than " + std::to_string(kMostCells) +
                           " columns or rows of the raster of " + station.name);
  }
}

}  // namespace cairn::stages
