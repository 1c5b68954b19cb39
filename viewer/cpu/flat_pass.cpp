#include "viewer/cpu/flat_pass.h"

#include "formats/error.h"
#include "viewer/cpu/nearest_buffer.h"

namespace cairn::viewer {
namespace {

void draw_pixels(const Lens& lens, const PointBatch& batch, std::uint64_t* words) {
  for (std::uint32_t i = 0; i < batch.count; ++i) {
    if (batch.depth[i] == 0) continue;
    const auto column = static_cast<std::int32_t>(batch.x[i]);
    const auto row = static_cast<std::int32_t>(batch.y[i]);
    keep_least(words[std::int64_t{row} * lens.width + column],
               pixel_word(batch.depth[i], batch.color[i]));
  }
}

void draw_squares(const Lens& lens, const PointBatch& batch, float half, std::uint64_t* words) {
  for (std::uint32_t i = 0; i < batch.count; ++i) {
    if (batch.depth[i] == 0) continue;
    const std::uint64_t word = pixel_word(batch.depth[i], batch.color[i]);
    const PixelRange columns = pixels_around(batch.x[i], half, lens.width);
    const PixelRange rows = pixels_around(batch.y[i], half, lens.height);
    for (int row = rows.begin; row < rows.end; ++row)
      for (int column = columns.begin; column < columns.end; ++column)
        keep_least(words[std::int64_t{row} * lens.width + column], word);
  }
}

void draw_disc(const Lens& lens, float x, float y, float radius, std::uint64_t word,
               std::uint64_t* words) {
  const PixelRange columns = pixels_around(x, radius, lens.width);
  const PixelRange rows = pixels_around(y, radius, lens.height);
  for (int row = rows.begin; row < rows.end; ++row) {
    const float dy = static_cast<float>(row) + 0.5f - y;
    for (int column = columns.begin; column < columns.end; ++column) {
      const float dx = static_cast<float>(column) + 0.5f - x;
      if (dx * dx + dy * dy <= radius * radius)
        keep_least(words[std::int64_t{row} * lens.width + column], word);
    }
  }
}

void draw_discs(const Lens& lens, const PointBatch& batch, const float* radius,
                std::uint64_t* words) {
  for (std::uint32_t i = 0; i < batch.count; ++i) {
    if (batch.depth[i] == 0) continue;
    const std::uint64_t word = pixel_word(batch.depth[i], batch.color[i]);
    const float x = batch.x[i];
    const float y = batch.y[i];
    draw_disc(lens, x, y, drawn_pixel_radius(lens, radius[i], batch.depth[i]), word, words);
    const auto pixel = pixel_of(lens, x, y);
    if (pixel >= 0) keep_least(words[pixel], word);
  }
}

}  // namespace

void draw_flat(const FramePlan& plan, const Lens& lens, const PointBatch& batch,
               const float* radius, std::span<std::uint64_t> words) {
  CAIRN_CHECK(plan.primitive != Primitive::kSplats);
  if (plan.primitive == Primitive::kDiscs)
    draw_discs(lens, batch, radius, words.data());
  else if (plan.point_pixels > 1)
    draw_squares(lens, batch, plan.point_pixels / 2, words.data());
  else
    draw_pixels(lens, batch, words.data());
}

}  // namespace cairn::viewer
