#include "viewer/cpu/cpu_renderer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "formats/error.h"
#include "viewer/cpu/flat_pass.h"
#include "viewer/cpu/nearest_buffer.h"
#include "viewer/cpu/resolve.h"

namespace cairn::viewer {
namespace {

constexpr std::uint32_t kChunkPoints = 16 * PointBatch::kSize;
/// Pixels that a task clears or normalizes at a time.
constexpr std::size_t kPixelGrain = 65536;

/// Calls work(first, count) for ranges of 0..size, in parallel.
template <typename Work>
void in_parallel(std::size_t size, std::size_t grain, const Work& work) {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, size, grain),
      [&](const tbb::blocked_range<std::size_t>& range) { work(range.begin(), range.size()); });
}

/// Makes `pixels` elements of this value, for a frame of any size.
template <typename T>
void reset(std::vector<T>& buffer, std::size_t pixels, const T& value) {
  if (buffer.size() != pixels) {
    buffer.clear();
    buffer.resize(pixels, value);
    buffer.shrink_to_fit();
    return;
  }
  in_parallel(pixels, kPixelGrain, [&](std::size_t first, std::size_t count) {
    std::fill_n(&buffer[first], count, value);
  });
}

void check_frame(const Frame& frame, const SlotPool& pool) {
  CAIRN_CHECK(pool.size().columns.holds(columns_of(frame.plan)));
  for (const DrawItem& item : frame.items) {
    CAIRN_CHECK(item.slot < pool.size().slots);
    const std::uint32_t points = pool.count(item.slot);
    CAIRN_CHECK(item.first <= points && item.count <= points - item.first);
  }
}

}  // namespace

void CpuRenderer::make_buffers(const Frame& frame) {
  picture_.size = frame.view.size();
  const std::size_t pixels = std::size_t{picture_.size.width} * picture_.size.height;
  reset(words_, pixels, kNoFragment);
  if (frame.plan.primitive == Primitive::kSplats) reset(sums_, pixels, SplatSums{});
}

void CpuRenderer::make_chunks(const std::vector<DrawItem>& items) {
  chunks_.clear();
  for (std::size_t i = 0; i < items.size(); ++i)
    for (std::uint32_t done = 0; done < items[i].count; done += kChunkPoints)
      chunks_.push_back({.item = i,
                         .first = items[i].first + done,
                         .count = std::min(kChunkPoints, items[i].count - done)});
}

template <typename Draw>
void CpuRenderer::for_each_batch(const Frame& frame, const BatchRules& rules,
                                 const Draw& draw) const {
  in_parallel(chunks_.size(), 1, [&](std::size_t first_chunk, std::size_t chunks) {
    PointBatch batch;
    for (std::size_t c = first_chunk; c < first_chunk + chunks; ++c) {
      const Chunk& chunk = chunks_[c];
      const DrawItem& item = frame.items[chunk.item];
      for (std::uint32_t done = 0; done < chunk.count; done += PointBatch::kSize) {
        const SlotColumns columns = pool_.columns(item.slot, chunk.first + done);
        batch.fill(rules, columns, std::min(PointBatch::kSize, chunk.count - done), item.offset,
                   item.tint);
        draw(batch, columns.radius);
      }
    }
  });
}

void CpuRenderer::draw_splats(const Frame& frame, BatchRules rules) {
  rules.colors = false;
  for_each_batch(frame, rules, [&](const PointBatch& batch, const float* radius) {
    find_surface(rules.lens, rules.oriented, batch, radius, words_);
  });
  rules.colors = true;
  for_each_batch(frame, rules, [&](const PointBatch& batch, const float* radius) {
    add_splats(rules.lens, rules.oriented, batch, radius, words_, sums_);
  });
  in_parallel(words_.size(), kPixelGrain, [&](std::size_t first, std::size_t count) {
    normalize(std::span(sums_).subspan(first, count), std::span(words_).subspan(first, count));
  });
}

DrawStatistics CpuRenderer::draw(const Frame& frame) {
  check_frame(frame, pool_);
  make_buffers(frame);
  make_chunks(frame.items);
  const BatchRules rules = batch_rules(frame);
  if (frame.plan.primitive == Primitive::kSplats)
    draw_splats(frame, rules);
  else
    for_each_batch(frame, rules, [&](const PointBatch& batch, const float* radius) {
      draw_flat(frame.plan, rules.lens, batch, radius, words_);
    });
  resolve(words_, frame.plan.eye_dome, picture_);
  DrawStatistics statistics;
  for (const DrawItem& item : frame.items) statistics.points += item.count;
  return statistics;
}

std::vector<std::uint8_t> CpuRenderer::covered() const {
  std::vector<std::uint8_t> covered(words_.size());
  std::ranges::transform(words_, covered.begin(), [](std::uint64_t word) {
    return static_cast<std::uint8_t>(word == kNoFragment ? 0 : 1);
  });
  return covered;
}

std::size_t CpuRenderer::buffer_bytes() const {
  return words_.capacity() * sizeof(words_[0]) + sums_.capacity() * sizeof(sums_[0]) +
         picture_.rgb.capacity();
}

}  // namespace cairn::viewer
