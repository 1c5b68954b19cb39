#include "stages/filter/compaction.h"

#include <cstring>
#include <mutex>

#include "formats/dataset/digest.h"
#include "formats/error.h"
#include "stages/parallel.h"

namespace cairn::stages {
namespace {

void add(FilteredPoints& sum, const FilteredPoints& part) {
  sum.points += part.points;
  sum.box.add(part.box);
  for (std::size_t s = 0; s < sum.sources.size(); ++s) {
    sum.sources[s].kept += part.sources[s].kept;
    sum.sources[s].box.add(part.sources[s].box);
    sum.sources[s].clamped += part.sources[s].clamped;
    for (std::size_t e = 0; e < kMostEffects; ++e)
      sum.sources[s].removed[e] += part.sources[s].removed[e];
  }
  for (std::size_t e = 0; e < sum.effects.size(); ++e) {
    sum.effects[e].removed += part.effects[e].removed;
    sum.effects[e].digest += part.effects[e].digest;
  }
}

class Compactor {
 public:
  Compactor(Cloud& cloud, std::size_t effects, bool keep_numbers, const Context& context)
      : cloud_(cloud), context_(context) {
    sum_.sources.resize(cloud.scans);
    sum_.effects.resize(effects);
    sum_.stride = keep_numbers ? cloud.leaves.stride() : cloud.content_bytes();
  }

  FilteredPoints run(Context& context) {
    const std::uint64_t leaves = cloud_.leaves.leaves();
    std::vector<std::uint64_t> starts(leaves + 1);
    for_each_piece(leaves, [&](std::uint64_t leaf) {
      cloud_.for_each_kept(leaf, [&](std::uint64_t, const std::byte*) { ++starts[leaf + 1]; });
      cloud_.release(leaf);
    });
    for (std::uint64_t leaf = 0; leaf < leaves; ++leaf) starts[leaf + 1] += starts[leaf];
    CAIRN_CHECK(starts.back() > 0);
    sum_.array = context.make_array("filter", starts.back() * sum_.stride);
    for_each_piece(leaves, [&](std::uint64_t leaf) { compact_leaf(leaf, starts[leaf]); });
    CAIRN_CHECK(sum_.points == starts.back());
    return std::move(sum_);
  }

 private:
  void compact_leaf(std::uint64_t leaf, std::uint64_t first) {
    throw_if_stopped(context_);
    FilteredPoints part;
    part.sources.resize(sum_.sources.size());
    part.effects.resize(sum_.effects.size());
    const formats::IndexRange range = cloud_.leaves.range_of(leaf);
    const std::size_t stride = cloud_.leaves.stride();
    const auto records = cloud_.leaves.of(leaf);
    std::vector<std::byte> record(stride);
    std::byte* out = sum_.array.bytes().data() + first * sum_.stride;
    for (std::uint64_t i = 0; i < range.count; ++i) {
      std::memcpy(record.data(), records.data() + i * stride, stride);
      if (!account(record, cloud_.mark_of(range.first + i), part)) continue;
      std::memcpy(out, record.data(), sum_.stride);
      out += sum_.stride;
    }
    cloud_.release(leaf);
    sum_.array.release(first * sum_.stride, part.points * sum_.stride);
    context_.progress->advance(range.count);
    const std::lock_guard lock(mutex_);  // sums of integers: the order does not matter
    add(sum_, part);
  }

  /// Applies the gains of a record and counts it. Whether it is kept.
  bool account(std::span<std::byte> record, std::uint8_t mark, FilteredPoints& part) const {
    const std::uint32_t scan = cloud_.scan_of(record.data());
    SourceOutcome& source = part.sources[scan];
    std::uint64_t clamped = 0;
    if (cloud_.balanced)
      clamped = formats::apply_gains(record, record.size(), *cloud_.balanced, cloud_.gains[scan]);
    if (mark != 0) {
      EffectOutcome& effect = part.effects.at(mark - 1U);
      ++effect.removed;
      ++source.removed[mark - 1U];
      effect.digest += formats::digest_of(record, record.size(), cloud_.content_bytes());
      return false;
    }
    const formats::GridPoint position = position_of(record.data());
    ++part.points;
    part.box.add(position);
    ++source.kept;
    source.box.add(position);
    source.clamped += clamped;
    return true;
  }

  Cloud& cloud_;
  const Context& context_;
  std::mutex mutex_;
  FilteredPoints sum_;
};

}  // namespace

FilteredPoints compact(Cloud& cloud, std::size_t effects, bool keep_numbers, Context& context) {
  FilteredPoints points;
  const std::uint64_t worker_bytes =
      cloud.leaves.tree().node_points() * (2 * cloud.leaves.stride() + 1);
  context.progress->begin("compact", cloud.leaves.tree().points());
  run_in_arena(workers_within(context, worker_bytes),
               [&] { points = Compactor(cloud, effects, keep_numbers, context).run(context); });
  context.progress->end();
  for (std::size_t scan = 0; scan < cloud.gains.size(); ++scan)
    std::copy(cloud.gains[scan].begin(), cloud.gains[scan].end(),
              points.sources[scan].gain.begin());
  return points;
}

}  // namespace cairn::stages
