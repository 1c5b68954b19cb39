#include "formats/scans/text_writer.h"

#include <charconv>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/lower_case.h"
#include "formats/scalar_value.h"
#include "formats/scans/crs.h"
#include "formats/scans/text_rows.h"

namespace cairn::formats {
namespace {

// The longest of all numbers, a double such as -2.2250738585072014e-308, and a separator.
constexpr std::size_t kMostNumberBytes = 25;
static_assert(DecimalAxis::kMostBytes < kMostNumberBytes);
constexpr std::size_t kFlushBytes = std::size_t{1} << 20;

template <typename T>
char* put_number(char* to, T value) {
  // What has no sign is one number to all readers.
  if constexpr (std::is_floating_point_v<T>)
    if (value != value) return std::copy_n("nan", 3, to);
  return std::to_chars(to, to + kMostNumberBytes, value).ptr;
}

}  // namespace

TextWriter::TextWriter(std::filesystem::path path, const ScanInfo& description,
                       std::uint64_t expected_points, bool replace)
    : path_(std::move(path)),
      description_(description),
      expected_points_(expected_points),
      commas_(lower_suffix(path_) == ".csv"),
      components_(named_components(description.schema)),
      part_(path_, replace) {
  if (components_.size() + 3 > kMostTextColumns)
    throw_usage(fmt::format("cannot write {}: the attributes need {} columns, more than {}",
                            path_.string(), components_.size() + 3, kMostTextColumns));
  if (description_.encoding == PositionEncoding::kSteps)
    for (std::size_t axis = 0; axis < 3; ++axis)
      axes_[axis] = DecimalAxis::of(description_.scale[axis], description_.offset[axis]);
  const std::string text = header();
  part_.file().append(std::as_bytes(std::span(text.data(), text.size())));
}

std::string TextWriter::header() const {
  const std::string crs = commas_ ? "" : crs_text(description_.crs);
  std::string text = crs.empty() ? "" : fmt::format("# {}{}\n", kCrsComment, crs);
  const char separator = commas_ ? ',' : ' ';
  text += fmt::format("x{0}y{0}z", separator);
  for (const NamedComponent& component : components_)
    text += fmt::format("{}{}", separator, component.name);
  return text + "\n";
}

void TextWriter::write(const PointBlock& block) {
  const Schema& schema = description_.schema;
  const bool steps = description_.encoding == PositionEncoding::kSteps;
  CAIRN_CHECK(block.count <= expected_points_ - points_);
  CAIRN_CHECK((steps ? block.steps.size() : block.world.size()) == block.count);
  CAIRN_CHECK(block.columns.size() == schema.size());
  for (std::size_t i = 0; i < schema.size(); ++i)
    CAIRN_CHECK(block.columns[i].size() == block.count * schema[i].size_bytes());
  const std::size_t most = (components_.size() + 3) * kMostNumberBytes;
  lines_.resize(kFlushBytes + most);
  char* to = lines_.data();
  const auto flush = [&] {
    part_.file().append(std::as_bytes(std::span(lines_.data(), to)));
    to = lines_.data();
  };
  for (std::size_t i = 0; i < block.count; ++i) {
    to = write_values(block, i, write_position(block, i, to));
    *to++ = '\n';
    if (static_cast<std::size_t>(to - lines_.data()) >= kFlushBytes) flush();
  }
  flush();
  points_ += block.count;
}

/// The last number of a line has no separator, which leaves room for its end.
char* TextWriter::write_position(const PointBlock& block, std::size_t point, char* to) const {
  const bool steps = description_.encoding == PositionEncoding::kSteps;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (axis > 0) *to++ = commas_ ? ',' : ' ';
    if (axes_[axis])
      to = axes_[axis]->write(to, block.steps[point][axis]);
    else
      to = put_number(to, steps ? description_.offset[axis] +
                                      description_.scale[axis] * block.steps[point][axis]
                                : block.world[point][axis]);
  }
  return to;
}

char* TextWriter::write_values(const PointBlock& block, std::size_t point, char* to) const {
  for (const NamedComponent& component : components_) {
    *to++ = commas_ ? ',' : ' ';
    const std::byte* at = block.columns[component.attribute].data() +
                          point * description_.schema[component.attribute].size_bytes() +
                          component.component * size_bytes(component.type);
    to = with_scalar_type(component.type,
                          [&]<typename T>(T) { return put_number(to, load_le<T>(at)); });
  }
  return to;
}

void TextWriter::finish() { part_.publish(); }

}  // namespace cairn::formats
