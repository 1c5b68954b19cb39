#include "formats/access/coalesce.h"

#include "formats/error.h"

namespace cairn::formats {
namespace {

class GrowingRun {
 public:
  GrowingRun(const ByteRange& range, const CoalesceLimits& limits)
      : limits_(limits), begin_(range.offset), end_(range.end()), wanted_(range.size_bytes) {}

  /// Takes a neighbour on either side, if that is worth while.
  bool take(const ByteRange& range) {
    const bool before = range.offset < begin_;
    const std::uint64_t gap = before ? begin_ - range.end() : range.offset - end_;
    const std::uint64_t begin = before ? range.offset : begin_;
    const std::uint64_t end = before ? end_ : range.end();
    const std::uint64_t wanted = wanted_ + range.size_bytes;
    if (gap > limits_.gap_bytes || end - begin > limits_.request_bytes ||
        end - begin - wanted > wanted / limits_.wanted_per_gap_byte)
      return false;
    begin_ = begin;
    end_ = end;
    wanted_ = wanted;
    return true;
  }

 private:
  const CoalesceLimits& limits_;
  std::uint64_t begin_, end_, wanted_;
};

}  // namespace

RangeRun run_around(std::span<const ByteRange> ranges, std::size_t at,
                    const CoalesceLimits& limits) {
  CAIRN_CHECK(at < ranges.size());
  GrowingRun run(ranges[at], limits);
  RangeRun found{at, at + 1};
  while (found.end < ranges.size() && run.take(ranges[found.end])) ++found.end;
  while (found.first > 0 && run.take(ranges[found.first - 1])) --found.first;
  return found;
}

}  // namespace cairn::formats
