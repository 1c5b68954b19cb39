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
#include "stages/simulate/station_view.h"

namespace cairn::stages {
namespace {

using formats::PointBlock;
using formats::ScanInfo;

/// Rays of one piece of work, whatever the number of threads.
constexpr std::uint64_t kPieceRays = 16384;
static_assert(kPieceRays <= formats::kBlockPoints);
/// Echoes that are on their way into a block: few enough to stay in the processor's cache.
constexpr std::size_t kPendingEchoes = 128;
/// Enough to estimate the share of hits.
constexpr double kCoarseRays = 20000;

/// In the schema; the last two if a beam may have several echoes.
constexpr std::size_t kNormal = 0, kIntensity = 1, kColor = 2, kReturnNumber = 3, kReturnCount = 4;

/// The points of some rays, and what making them took.
struct Piece {
  PointBlock block;
  EffectCalls effect_calls{};
};

class StationScan {
 public:
  StationScan(const std::vector<SceneObject>& objects, const Station& station,
              const StationEffects& effects, ScanFrame frame, const ScanInfo& description)
      : station_(station),
        effects_(effects),
        frame_(frame),
        description_(description),
        recorded_pose_(effects.recorded(station).pose()),
        view_(objects, station, effects) {
    for (std::uint64_t row = 0; row < station.raster.rows; ++row)
      elevations_.push_back(sine_cosine(station.raster.elevation(row)));
  }

  /// What comes of the rays from `first` on.
  std::unique_ptr<Piece> scan(std::uint64_t first, std::uint64_t count) const {
    auto piece = std::make_unique<Piece>();
    PointBlock& block = piece->block;
    formats::resize_block(description_.schema, description_.encoding,
                          count * effects_.most_echoes(), block);
    std::size_t recorded = 0;
    std::vector<Echo> echoes;
    echoes.reserve(kPendingEchoes + effects_.most_echoes());
    const auto record_all = [&] {
      for (const Echo& echo : echoes) record(echo, recorded++, block);
      echoes.clear();
    };
    const std::uint64_t rows = station_.raster.rows;
    SineCosine azimuth{};
    for (std::uint64_t ray = first; ray < first + count; ++ray) {
      const std::uint64_t column = ray / rows, row = ray % rows;
      if (ray == first || row == 0) azimuth = sine_cosine(station_.raster.azimuth(column));
      const SineCosine& elevation = elevations_[row];
      const Vector3 direction{elevation.cosine * azimuth.cosine, elevation.cosine * azimuth.sine,
                              elevation.sine};
      RayEchoes of_ray(echoes);
      if (const auto echo = view_.look(ray, direction)) of_ray.add(*echo);
      if (effects_.change_echoes())
        effects_.apply({ray, direction, station_.max_range, view_}, of_ray, piece->effect_calls);
      if (echoes.size() >= kPendingEchoes) record_all();
    }
    record_all();
    formats::resize_block(description_.schema, description_.encoding, recorded, block);
    return piece;
  }

 private:
  void record(const Echo& echo, std::size_t i, PointBlock& block) const {
    Vector3 point = echo.direction * echo.range;
    Vector3 normal = echo.normal;
    if (frame_ == ScanFrame::kWorld) {
      point = formats::place(recorded_pose_, point);
      normal = formats::multiply(recorded_pose_.linear, normal);
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
                      static_cast<std::uint16_t>(std::lround(65535 * echo.intensity)));
    for (std::size_t channel = 0; channel < 3; ++channel)
      block.columns[kColor][3 * i + channel] = std::byte{echo.color[channel]};
    if (description_.schema.size() <= kReturnNumber) return;
    block.columns[kReturnNumber][i] = std::byte{echo.return_number};
    block.columns[kReturnCount][i] = std::byte{echo.return_count};
  }

  const Station& station_;
  const StationEffects& effects_;
  ScanFrame frame_;
  const ScanInfo& description_;
  formats::Pose recorded_pose_;  ///< in which points are placed
  StationView view_;
  std::vector<SineCosine> elevations_;
};

void add(const Piece& piece, ScanCounts& counts) {
  counts.points += piece.block.count;
  for (std::size_t i = 0; i < kEffects; ++i) counts.effect_calls[i] += piece.effect_calls[i];
}

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
                        const Station& station, const StationEffects& effects) {
  Station coarse = station;
  const auto rays = static_cast<double>(station.raster.rays());
  coarse.raster = scaled(station.raster, std::min(1.0, std::sqrt(kCoarseRays / rays)));
  Context quiet = context;
  quiet.progress = nullptr;
  const std::uint64_t points =
      scan_station(quiet, objects, coarse, effects, ScanFrame::kSensor,
                   describe_station(coarse, ScanFrame::kSensor, false, effects.most_echoes()),
                   [](const PointBlock&) {})
          .points;
  return rays * static_cast<double>(points) / static_cast<double>(coarse.raster.rays());
}

/// A power of ten that counts `reach` in an int32.
double step_for(double reach) {
  double step = 1e-5;
  while (reach / step > 2e9) step *= 10;
  return step;
}

}  // namespace

ScanInfo describe_station(const Station& station, ScanFrame frame, bool steps,
                          std::uint64_t most_echoes) {
  using formats::ReduceRule;
  using formats::ScalarType;
  ScanInfo info;
  info.format = "simulated";
  info.schema = {
      {std::string(formats::attribute_name::kNormal), ScalarType::kF32, 3, ReduceRule::kNormal},
      {std::string(formats::attribute_name::kIntensity), ScalarType::kU16, 1, ReduceRule::kMean},
      {std::string(formats::attribute_name::kColor), ScalarType::kU8, 3, ReduceRule::kMean}};
  if (most_echoes > 1)
    for (const auto name :
         {formats::attribute_name::kReturnNumber, formats::attribute_name::kReturnCount})
      info.schema.push_back({std::string(name), ScalarType::kU8, 1, ReduceRule::kNone});
  info.claimed_points = info.present_points = station.raster.rays() * most_echoes;
  if (!steps) return info;
  info.encoding = formats::PositionEncoding::kSteps;
  info.scale.fill(step_for(station.max_range + 1));
  if (frame == ScanFrame::kWorld)
    for (std::size_t axis = 0; axis < 3; ++axis)
      info.offset[axis] = std::round(station.position[axis]);
  return info;
}

ScanCounts scan_station(const Context& context, const std::vector<SceneObject>& objects,
                        const Station& station, const StationEffects& effects, ScanFrame frame,
                        const ScanInfo& description, const formats::BlockSink& sink) {
  std::uint64_t next = 0;
  ScanCounts counts{.effect_calls = effects.other_calls(station.raster.rays())};
  const std::uint64_t rays = station.raster.rays();
  const unsigned threads = std::max(1U, context.threads);
  run_in_arena(threads, [&] {
    const StationScan scan(objects, station, effects, frame, description);
    using PiecePtr = std::shared_ptr<const Piece>;
    tbb::parallel_pipeline(std::size_t{4} * threads,
                           tbb::make_filter<void, std::uint64_t>(tbb::filter_mode::serial_in_order,
                                                                 [&](tbb::flow_control& flow) {
                                                                   if (next >= rays) flow.stop();
                                                                   const std::uint64_t first = next;
                                                                   next += kPieceRays;
                                                                   return first;
                                                                 }) &
                               tbb::make_filter<std::uint64_t, PiecePtr>(
                                   tbb::filter_mode::parallel,
                                   [&](std::uint64_t first) -> PiecePtr {
                                     throw_if_stopped(context);
                                     const std::uint64_t count = std::min(kPieceRays, rays - first);
                                     PiecePtr piece = scan.scan(first, count);
                                     if (context.progress != nullptr)
                                       context.progress->advance(count);
                                     return piece;
                                   }) &
                               tbb::make_filter<PiecePtr, void>(tbb::filter_mode::serial_in_order,
                                                                [&](const PiecePtr& piece) {
                                                                  add(*piece, counts);
                                                                  if (piece->block.count > 0)
                                                                    sink(piece->block);
                                                                }));
  });
  return counts;
}

void scale_to_points(const Context& context, std::uint64_t points, const Effects& effects,
                     Scene& scene) {
  double expected = 0;
  for (std::size_t i = 0; i < scene.stations.size(); ++i)
    expected +=
        estimated_points(context, scene.objects, scene.stations[i], StationEffects(effects, i));
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
