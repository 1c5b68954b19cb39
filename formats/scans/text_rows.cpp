#include "formats/scans/text_rows.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "formats/scans/resize_block.h"

namespace cairn::formats {
namespace {

/// Whether a vector has length 1 to the few digits that texts give, or 0.
bool is_unit_or_zero(const double* v, bool& is_unit) {
  constexpr double kTolerance = 0.02;
  const double squared = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
  is_unit = std::fabs(squared - 1) <= kTolerance;
  return is_unit || squared == 0;
}

/// Parses rows into a block, one after the other.
class RowParser {
 public:
  RowParser(const TextRows& rows, const Schema& schema) : rows_(rows), schema_(schema) {}

  /// Returns false if the row is an empty cell; the slot is then free again.
  bool parse(const LineReader& lines, std::size_t slot, PointBlock& block) const {
    std::string_view rest = lines.line(), field;
    auto& position = block.world[slot];
    for (std::size_t i = 0; i < rows_.layout.columns.size(); ++i) {
      if (!next_field(rest, rows_.separator, field))
        refuse_count(lines, rows_.separator, rows_.layout.columns.size());
      const TextLayout::Column& column = rows_.layout.columns[i];
      if (column.role == TextLayout::Role::kLeftOut) continue;
      if (!parse_field(field, column.type, target(column, slot, position, block)))
        refuse_value(lines, i, field);
    }
    if (next_field(rest, rows_.separator, field))
      refuse_count(lines, rows_.separator, rows_.layout.columns.size());
    return !rows_.gridded || position[0] != 0 || position[1] != 0 || position[2] != 0;
  }

 private:
  std::byte* target(const TextLayout::Column& column, std::size_t slot,
                    std::array<double, 3>& position, PointBlock& block) const {
    if (column.role == TextLayout::Role::kPosition)
      return reinterpret_cast<std::byte*>(&position[column.component]);
    return block.columns[column.attribute].data() + slot * schema_[column.attribute].size_bytes() +
           column.component * size_bytes(column.type);
  }

  const TextRows& rows_;
  const Schema& schema_;
};

bool next_row(LineReader& lines, const TextRows& rows) {
  do {
    if (!lines.next()) return false;
  } while (rows.counts_between && has_one_field(lines.line(), rows.separator));
  return true;
}

}  // namespace

void refuse_count(const LineReader& lines, Separator separator, std::size_t expected) {
  const std::size_t found = count_fields(lines.line(), separator);
  if (found + 1 == expected && ends_with_empty_field(lines.line(), separator))
    refuse_value(lines, found, "");
  lines.refuse(found < expected ? "too few values" : "too many values", fmt::format("{}", found),
               fmt::format("{}", expected));
}

void refuse_value(const LineReader& lines, std::size_t column, std::string_view field) {
  lines.refuse(fmt::format("value {} is {}", column + 1, field.empty() ? "empty" : "damaged"),
               field, "a number");
}

RowPass::RowPass(Separator separator, std::vector<ColumnUse> uses)
    : separator_(separator), uses_(std::move(uses)) {
  const std::size_t count = uses_.size();
  columns_.values.resize(count);
  columns_.begins_unit_vector.resize(count);
  saw_unit_vector_.resize(count);
  row_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (uses_[i] == ColumnUse::kLookedAt) looked_at_ = i + 1;
    if (looked_at_ == i + 1 && i >= 2 && uses_[i - 1] == uses_[i] && uses_[i - 2] == uses_[i])
      unit_candidates_.push_back(i - 2);
  }
}

void RowPass::add(const LineReader& lines) {
  if (rows_ % kStretchRows == 0) stretches_.push_back({lines.offset(), lines.number(), 0});
  ++stretches_.back().rows;
  ++rows_;
  std::string_view rest = lines.line(), field;
  for (std::size_t i = 0; i < looked_at_; ++i) {
    if (!next_field(rest, separator_, field)) refuse_count(lines, separator_, uses_.size());
    if (uses_[i] == ColumnUse::kLookedAt && !columns_.values[i].add(field, row_[i]))
      refuse_value(lines, i, field);
  }
  if (!unit_candidates_.empty()) look_for_unit_vectors();
}

void RowPass::look_for_unit_vectors() {
  std::erase_if(unit_candidates_, [&](std::size_t i) {
    bool is_unit = false;
    const bool holds = is_unit_or_zero(&row_[i], is_unit);
    if (is_unit) saw_unit_vector_[i] = true;
    columns_.begins_unit_vector[i] = holds && saw_unit_vector_[i];
    return !holds;
  });
}

bool RowPass::is_whole_row(std::string_view line) const {
  double value = 0;
  std::string_view field;
  for (const ColumnUse use : uses_)
    if (!next_field(line, separator_, field) ||
        (use != ColumnUse::kLeftOut && !ColumnValues().add(field, value)))
      return false;
  return !next_field(line, separator_, field);
}

std::vector<TextStretch> RowPass::stretches() && { return std::move(stretches_); }

void read_text_rows(const RandomAccessFile& file, const TextStretch& stretch, const TextRows& rows,
                    const Schema& schema, const std::function<void(const PointBlock&)>& sink) {
  constexpr std::size_t kPositionBytes = 3 * sizeof(double);
  const std::size_t block_rows = block_points_for(RecordLayout(schema, kPositionBytes).stride);
  const RowParser parser(rows, schema);
  LineReader lines(file, stretch.offset, stretch.line);
  PointBlock block;
  for (std::uint64_t left = stretch.rows; left > 0;) {
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(block_rows, left));
    resize_block(schema, PositionEncoding::kFloat64, wanted, block);
    std::size_t count = 0;
    for (std::size_t i = 0; i < wanted; ++i) {
      if (!next_row(lines, rows))
        lines.refuse("the file ended while it was read", "", fmt::format("{} more rows", left - i));
      count += parser.parse(lines, count, block) ? 1 : 0;
    }
    resize_block(schema, PositionEncoding::kFloat64, count, block);
    block.no_return = wanted - count;
    sink(block);
    left -= wanted;
  }
}

}  // namespace cairn::formats
