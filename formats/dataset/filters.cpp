#include "formats/dataset/filters.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>

#include "formats/bytes.h"
#include "formats/dataset/rice.h"

namespace cairn::formats {
namespace {

static_assert(kRiceBlock == kLaneBlock);

/// Room for a plan and the heads of a few blocks. A column split into digits has three times its size as planes.
constexpr std::size_t kSizeSlack = 16;
/// Points on which plans are tried.
constexpr std::size_t kTrialPoints = 4096;
constexpr std::size_t kLongestRun = 256;

/// Calls `f` with a zero of the unsigned type as wide as the column's scalars.
template <typename F>
decltype(auto) with_unsigned(const ColumnShape& shape, F f) {
  switch (shape.scalar_bytes()) {
    case 1:
      return f(std::uint8_t{0});
    case 2:
      return f(std::uint16_t{0});
    case 4:
      return f(std::uint32_t{0});
    default:
      return f(std::uint64_t{0});
  }
}

DecodeError error_at(std::size_t offset, std::string what, std::size_t found,
                     std::size_t expected) {
  return {.what = std::move(what),
          .byte_offset = offset,
          .found = std::to_string(found),
          .expected = std::to_string(expected)};
}

// --- constant ---------------------------------------------------------------------------------------

bool apply_constant(std::span<const std::byte> column, const ColumnShape& shape,
                    std::vector<std::byte>& out) {
  if (column.empty()) return true;
  // Equal to itself one point further on.
  const std::size_t stride = shape.point_bytes();
  if (std::memcmp(column.data(), column.data() + stride, column.size() - stride) != 0) return false;
  out.insert(out.end(), column.begin(), column.begin() + static_cast<std::ptrdiff_t>(stride));
  return true;
}

void fill_points(std::span<const std::byte> point, std::size_t n, std::byte* out) {
  if (point.size() == 1) {
    std::memset(out, std::to_integer<int>(point[0]), n);
    return;
  }
  for (std::size_t i = 0; i < n; ++i)
    std::memcpy(out + i * point.size(), point.data(), point.size());
}

std::optional<DecodeError> undo_constant(std::span<const std::byte> filtered,
                                         const ColumnShape& shape, std::span<std::byte> column) {
  const std::size_t expected = column.empty() ? 0 : shape.point_bytes();
  if (filtered.size() != expected)
    return error_at(0, "bytes of a constant", filtered.size(), expected);
  fill_points(filtered, shape.count, column.data());
  return std::nullopt;
}

// --- runs -------------------------------------------------------------------------------------------

bool apply_runs(std::span<const std::byte> column, const ColumnShape& shape,
                std::vector<std::byte>& out) {
  const std::size_t stride = shape.point_bytes();
  const std::size_t most_runs = column.size() / (stride + 1);  // more would not be smaller
  std::vector<std::byte> lengths;
  std::vector<std::byte> points;
  for (std::size_t i = 0; i < shape.count;) {
    const std::byte* point = column.data() + i * stride;
    std::size_t n = 1;
    while (n < kLongestRun && i + n < shape.count &&
           std::memcmp(point, point + n * stride, stride) == 0)
      ++n;
    if (lengths.size() == most_runs) return false;
    lengths.push_back(static_cast<std::byte>(n - 1));
    points.insert(points.end(), point, point + stride);
    i += n;
  }
  std::array<std::byte, 4> run_count;
  store_le(run_count.data(), static_cast<std::uint32_t>(lengths.size()));
  out.insert(out.end(), run_count.begin(), run_count.end());
  out.insert(out.end(), lengths.begin(), lengths.end());
  out.insert(out.end(), points.begin(), points.end());
  return true;
}

std::optional<DecodeError> undo_runs(std::span<const std::byte> filtered, const ColumnShape& shape,
                                     std::span<std::byte> column) {
  ByteReader reader(filtered);
  const auto run_count = reader.read<std::uint32_t>();
  if (!run_count) return error_at(0, "bytes of a run count", filtered.size(), 4);
  const std::size_t stride = shape.point_bytes();
  const std::size_t expected = *run_count * (stride + 1);  // below 2^32 * 2^11
  if (reader.remaining() != expected)
    return error_at(4, "bytes of runs", reader.remaining(), expected);
  const auto lengths = filtered.subspan(4, *run_count);
  const auto points = filtered.subspan(4 + *run_count);
  std::size_t done = 0;
  for (std::size_t run = 0; run < lengths.size(); ++run) {
    const std::size_t n = std::to_integer<std::size_t>(lengths[run]) + 1;
    if (n > shape.count - done) return error_at(4 + run, "points of a run", n, shape.count - done);
    fill_points(points.subspan(run * stride, stride), n, column.data() + done * stride);
    done += n;
  }
  if (done != shape.count)
    return error_at(filtered.size(), "points of all runs", done, shape.count);
  return std::nullopt;
}

// --- plans ------------------------------------------------------------------------------------------

template <typename U>
void write_plan(const LanePlan& plan, std::vector<std::byte>& out) {
  out.push_back(static_cast<std::byte>(plan.flags));
  if (!plan.has(LanePlan::kFactor)) return;
  out.resize(out.size() + sizeof(U));
  store_le(out.data() + out.size() - sizeof(U), static_cast<U>(plan.factor));
}

template <typename U>
std::optional<LanePlan> read_plan(ByteReader& reader, const ColumnShape& shape) {
  const auto flags = reader.read<std::uint8_t>();
  if (!flags) return std::nullopt;
  LanePlan plan{.flags = *flags};
  if (!plan_fits(plan, shape)) return std::nullopt;
  if (plan.has(LanePlan::kFactor)) {
    const auto factor = reader.read<U>();
    if (!factor) return std::nullopt;
    plan.factor = *factor;
  }
  return plan;
}

DecodeError plan_error(std::span<const std::byte> filtered) {
  return {.what = "lane plan that does not fit the column",
          .found = filtered.empty()
                       ? "nothing"
                       : "flags " + std::to_string(std::to_integer<unsigned>(filtered[0]))};
}

// --- planes -----------------------------------------------------------------------------------------

template <typename U>
bool apply_planes(const LanePlan& plan, std::span<const std::byte> column, const ColumnShape& shape,
                  std::vector<std::byte>& out) {
  write_plan<U>(plan, out);
  LaneSplitter<U> splitter(shape, plan);
  const std::size_t begin = out.size();
  out.resize(begin + splitter.lanes() * shape.count * sizeof(U));
  std::vector<U> block(splitter.lanes() * kLaneBlock);
  for (std::size_t first = 0; first < shape.count; first += kLaneBlock) {
    const std::size_t n = std::min(kLaneBlock, shape.count - first);
    splitter.split(column.data() + first * shape.point_bytes(), n, block);
    for (std::size_t lane = 0; lane < splitter.lanes(); ++lane)
      for (std::size_t byte = 0; byte < sizeof(U); ++byte) {
        std::byte* plane = out.data() + begin + (lane * sizeof(U) + byte) * shape.count + first;
        for (std::size_t i = 0; i < n; ++i)
          plane[i] = static_cast<std::byte>(block[lane * kLaneBlock + i] >> (8 * byte));
      }
  }
  return true;
}

template <typename U>
std::optional<DecodeError> undo_planes(std::span<const std::byte> filtered,
                                       const ColumnShape& shape, std::span<std::byte> column) {
  ByteReader reader(filtered);
  const auto plan = read_plan<U>(reader, shape);
  if (!plan) return plan_error(filtered);
  LaneJoiner<U> joiner(shape, *plan);
  const std::size_t expected = joiner.lanes() * shape.count * sizeof(U);
  if (reader.remaining() != expected)
    return error_at(reader.position(), "bytes of planes", reader.remaining(), expected);
  const std::byte* planes = filtered.data() + reader.position();
  std::vector<U> block(joiner.lanes() * kLaneBlock);
  for (std::size_t first = 0; first < shape.count; first += kLaneBlock) {
    const std::size_t n = std::min(kLaneBlock, shape.count - first);
    std::fill(block.begin(), block.end(), U{0});
    for (std::size_t lane = 0; lane < joiner.lanes(); ++lane)
      for (std::size_t byte = 0; byte < sizeof(U); ++byte) {
        const std::byte* plane = planes + (lane * sizeof(U) + byte) * shape.count + first;
        for (std::size_t i = 0; i < n; ++i)
          block[lane * kLaneBlock + i] =
              static_cast<U>(block[lane * kLaneBlock + i] | std::to_integer<std::uint64_t>(plane[i])
                                                                << (8 * byte));
      }
    joiner.join(block, n, column.data() + first * shape.point_bytes());
  }
  return std::nullopt;
}

// --- rice -------------------------------------------------------------------------------------------

template <typename U>
bool apply_rice(const LanePlan& plan, std::span<const std::byte> column, const ColumnShape& shape,
                std::vector<std::byte>& out) {
  const std::size_t before = out.size();
  const std::size_t limit = before + filtered_size_limit(shape);
  write_plan<U>(plan, out);
  LaneSplitter<U> splitter(shape, plan);
  std::vector<U> block(splitter.lanes() * kLaneBlock);
  for (std::size_t first = 0; first < shape.count && out.size() <= limit; first += kLaneBlock) {
    const std::size_t n = std::min(kLaneBlock, shape.count - first);
    splitter.split(column.data() + first * shape.point_bytes(), n, block);
    for (std::size_t lane = 0; lane < splitter.lanes(); ++lane)
      rice_encode(std::span<const U>(block).subspan(lane * kLaneBlock, n), out);
  }
  if (out.size() <= limit) return true;
  out.resize(before);
  return false;
}

template <typename U>
std::optional<DecodeError> undo_rice(std::span<const std::byte> filtered, const ColumnShape& shape,
                                     std::span<std::byte> column) {
  ByteReader reader(filtered);
  const auto plan = read_plan<U>(reader, shape);
  if (!plan) return plan_error(filtered);
  LaneJoiner<U> joiner(shape, *plan);
  std::vector<U> block(joiner.lanes() * kLaneBlock);
  std::size_t at = reader.position();
  for (std::size_t first = 0; first < shape.count; first += kLaneBlock) {
    const std::size_t n = std::min(kLaneBlock, shape.count - first);
    for (std::size_t lane = 0; lane < joiner.lanes(); ++lane) {
      const auto used =
          rice_decode(filtered.subspan(at), std::span<U>(block).subspan(lane * kLaneBlock, n));
      if (!used)
        return DecodeError{.what = "rice block that is damaged or cut short", .byte_offset = at};
      at += *used;
    }
    joiner.join(block, n, column.data() + first * shape.point_bytes());
  }
  if (at != filtered.size())
    return error_at(at, "bytes behind the last rice block", filtered.size() - at, 0);
  return std::nullopt;
}

}  // namespace

std::optional<Filter> filter_of(std::uint8_t wanted) {
  if (wanted > static_cast<std::uint8_t>(Filter::kRice)) return std::nullopt;
  return static_cast<Filter>(wanted);
}

std::size_t filtered_size_limit(const ColumnShape& shape) {
  return 3 * shape.size_bytes() + kSizeSlack;
}

LanePlan choose_plan(std::span<const std::byte> column, const ColumnShape& shape) {
  return with_unsigned(shape, [&]<typename U>(U) {
    LanePlan base;
    base.factor = common_factor<U>(column);
    if (base.factor > 1) base.flags |= LanePlan::kFactor;
    if (is_monotone<U>(column, shape.components)) {
      base.flags |= LanePlan::kMonotone;
      return base;
    }
    std::vector<std::uint8_t> extra{0, LanePlan::kAbsolute};
    for (const auto flag : {LanePlan::kGreenDifference, LanePlan::kCubeDigits})
      if (plan_fits({.flags = flag}, shape)) extra.push_back(flag);

    ColumnShape trial = shape;
    trial.count = std::min(shape.count, kTrialPoints);
    const std::size_t first = (shape.count - trial.count) / 2;
    const auto stretch = column.subspan(first * shape.point_bytes(), trial.size_bytes());
    LanePlan best = base;
    std::vector<std::byte> coded;
    std::size_t best_size = SIZE_MAX;
    for (const std::uint8_t flags : extra) {
      LanePlan plan = base;
      plan.flags |= flags;
      coded.clear();
      if (!apply_rice<U>(plan, stretch, trial, coded) || coded.size() >= best_size) continue;
      best_size = coded.size();
      best = plan;
    }
    return best;
  });
}

bool apply_filter(Filter filter, const LanePlan& plan, std::span<const std::byte> column,
                  const ColumnShape& shape, std::vector<std::byte>& out) {
  CAIRN_CHECK(column.size() == shape.size_bytes());
  switch (filter) {
    case Filter::kPlain:
      out.insert(out.end(), column.begin(), column.end());
      return true;
    case Filter::kConstant:
      return apply_constant(column, shape, out);
    case Filter::kRuns:
      return apply_runs(column, shape, out);
    case Filter::kPlanes:
      return with_unsigned(
          shape, [&]<typename U>(U) { return apply_planes<U>(plan, column, shape, out); });
    case Filter::kRice:
      return with_unsigned(shape,
                           [&]<typename U>(U) { return apply_rice<U>(plan, column, shape, out); });
  }
  return false;
}

std::optional<DecodeError> undo_filter(Filter filter, std::span<const std::byte> filtered,
                                       const ColumnShape& shape, std::span<std::byte> column) {
  CAIRN_CHECK(column.size() == shape.size_bytes());
  switch (filter) {
    case Filter::kPlain:
      if (filtered.size() != column.size())
        return error_at(0, "bytes of a plain column", filtered.size(), column.size());
      std::copy(filtered.begin(), filtered.end(), column.begin());
      return std::nullopt;
    case Filter::kConstant:
      return undo_constant(filtered, shape, column);
    case Filter::kRuns:
      return undo_runs(filtered, shape, column);
    case Filter::kPlanes:
      return with_unsigned(shape,
                           [&]<typename U>(U) { return undo_planes<U>(filtered, shape, column); });
    case Filter::kRice:
      return with_unsigned(shape,
                           [&]<typename U>(U) { return undo_rice<U>(filtered, shape, column); });
  }
  return DecodeError{.what = "unknown filter",
                     .found = std::to_string(static_cast<unsigned>(filter))};
}

}  // namespace cairn::formats
