#include "formats/scans/text_reader.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/lower_case.h"
#include "formats/scans/crs.h"
#include "formats/scans/parse_number.h"

namespace cairn::formats {
namespace {

using Fields = std::vector<std::string_view>;

Fields fields_of(std::string_view line) {
  const Separator separator = separator_of(line);
  Fields fields;
  for (std::string_view field; next_field(line, separator, field);) fields.push_back(field);
  return fields;
}

bool is_number(std::string_view field) {
  double value = 0;
  return parse_number(field, ScalarType::kF64, reinterpret_cast<std::byte*>(&value));
}

std::optional<std::uint64_t> count_in(const Fields& fields) {
  std::uint64_t count = 0;
  if (fields.size() != 1 ||
      !parse_number(fields.front(), ScalarType::kU64, reinterpret_cast<std::byte*>(&count)))
    return std::nullopt;
  return count;
}

std::vector<std::string> names_in(const Fields& fields) {
  std::vector<std::string> names;
  for (std::string_view field : fields) {
    if (field.size() >= 2 && field.front() == '"' && field.back() == '"')
      field = field.substr(1, field.size() - 2);
    names.emplace_back(field);
  }
  return names;
}

/// Whether a line is a row: all its fields, or of columns that are named those of the position, are numbers.
bool is_row(const Fields& fields, const std::vector<std::string>& given) {
  if (given.empty()) return std::all_of(fields.begin(), fields.end(), is_number);
  const auto position = find_position(given);
  return !position || std::all_of(position->begin(), position->end(), [&](std::size_t column) {
    return column >= fields.size() || is_number(fields[column]);
  });
}

/// Throws kInput if the fields are those of a row, but for an empty one.
void refuse_empty_field(const Fields& fields, const LineReader& lines) {
  const auto empty = std::find(fields.begin(), fields.end(), std::string_view{});
  const auto is_empty_or_number = [](std::string_view f) { return f.empty() || is_number(f); };
  if (empty != fields.end() && std::all_of(fields.begin(), fields.end(), is_empty_or_number))
    refuse_value(lines, static_cast<std::size_t>(empty - fields.begin()), *empty);
}

/// Keeps account of the rows that the counts of a file promise.
class Promise {
 public:
  explicit Promise(std::optional<std::uint64_t> count) : counted_(count), left_(count.value_or(0)) {
    claimed_ = left_;
  }
  bool is_counted() const { return counted_.has_value(); }
  bool is_kept() const { return left_ == 0; }
  std::uint64_t claimed() const { return claimed_; }
  std::uint64_t left() const { return left_; }

  void add_row() {
    if (left_ > 0)
      --left_;
    else
      ++claimed_;
  }

  /// Begins a block; false if the claim exceeds all that can be counted.
  bool begin_block(std::uint64_t count) {
    left_ = count;
    return !__builtin_add_overflow(claimed_, count, &claimed_);
  }

 private:
  std::optional<std::uint64_t> counted_;
  std::uint64_t left_ = 0;
  std::uint64_t claimed_ = 0;
};

/// A line of one number amid the rows begins the next block of a file with counts.
void begin_block(Promise& promise, const LineReader& lines, Separator separator) {
  std::string_view rest = lines.line(), field;
  next_field(rest, separator, field);
  const auto count = count_in({field});
  if (!promise.is_counted() || !count) lines.refuse("too few values", lines.line(), "a row");
  if (!promise.is_kept())
    lines.refuse("a block of points ends too early", "a count",
                 fmt::format("{} more rows", promise.left()));
  if (!promise.begin_block(*count))
    lines.refuse("more points are promised than can be counted", field, "a smaller count");
}

/// Columns without names are taken to begin with the position.
std::vector<ColumnUse> uses_of(const std::vector<std::string>& names, std::size_t columns) {
  std::vector<ColumnUse> uses(columns, ColumnUse::kLookedAt);
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == kLeftOutColumn) uses[i] = ColumnUse::kLeftOut;
  for (const std::size_t i : find_position(names).value_or(std::array<std::size_t, 3>{0, 1, 2}))
    uses[i] = ColumnUse::kPosition;
  return uses;
}

}  // namespace

bool begins_with_rows(std::string_view beginning) {
  constexpr std::size_t kLeastValues = 3;
  bool counted = false;
  while (!beginning.empty()) {
    const std::size_t end = beginning.find('\n');
    const std::string_view line = beginning.substr(0, end);
    beginning.remove_prefix(end == std::string_view::npos ? beginning.size() : end + 1);
    const Fields fields = fields_of(line);
    if (fields.empty() || is_comment(line)) continue;
    if (!std::all_of(fields.begin(), fields.end(), is_number)) return false;
    if (counted || !count_in(fields)) return fields.size() >= kLeastValues;
    counted = true;
  }
  return false;
}

TextReader::TextReader(const std::filesystem::path& path, const ScanOptions& options)
    : file_(path), is_pts_(lower_suffix(path) == ".pts") {
  info_.path = path;
  info_.encoding = PositionEncoding::kFloat64;
  info_.guesses_color_width = true;
  LineReader lines(file_, text_start(file_));
  Head head = read_head(lines, options);
  info_.crs = std::move(head.crs);
  rows_.counts_between = head.count.has_value();
  const std::size_t columns = count_columns(lines, head, options);
  std::vector<std::string> names = names_of(head, columns, lines, options);
  RowPass pass = count_rows(lines, head, uses_of(names, columns), options);
  info_.present_points = pass.rows();
  if (names.empty()) names = recognise_columns(pass.columns(), is_pts_);
  lay_out(names, pass.columns());
  stretches_ = std::move(pass).stretches();
}

/// Of the first row, or where there is none, of what names there are.
std::size_t TextReader::count_columns(const LineReader& lines, const Head& head,
                                      const ScanOptions& options) {
  const auto& names = options.columns.empty() ? head.names : options.columns;
  if (head.has_row) rows_.separator = separator_of(lines.line());
  const std::size_t columns = head.has_row    ? count_fields(lines.line(), rows_.separator)
                              : names.empty() ? 3
                                              : names.size();
  if (columns < 3 || columns > kMostTextColumns)
    lines.refuse("no row of points", fmt::format("{} values", columns),
                 fmt::format("3 to {}", kMostTextColumns));
  return columns;
}

TextReader::Head TextReader::read_head(LineReader& lines, const ScanOptions& options) const {
  Head head;
  while (lines.next_or_comment()) {
    if (is_comment(lines.line())) {
      if (auto crs = crs_of_comment(comment_text(lines.line())); !crs.empty()) {
        if (head.crs.empty()) head.crs = std::move(crs);
        continue;
      }
      auto names = names_in(fields_of(comment_text(lines.line())));
      if (find_position(names)) head.comment = std::move(names);
      continue;
    }
    // Of several promised rows the first is cut off by the end of the file: there is none.
    if (head.count.value_or(0) > 1 && !lines.was_ended()) return head;
    const Fields fields = fields_of(lines.line());
    if (const auto count = count_in(fields); count && head.count.value_or(0) == 0) {
      head.count = count;
    } else if (is_row(fields, options.columns)) {
      head.has_row = true;
      return head;
    } else {
      auto names = names_in(fields);
      if (!head.names.empty() || (options.columns.empty() && !find_position(names))) {
        refuse_empty_field(fields, lines);
        lines.refuse("neither numbers nor names of columns", lines.line(),
                     "three or more numbers, or names with x, y and z");
      }
      head.names = std::move(names);
    }
  }
  if (head.names.empty() && !head.count)
    throw_input({.what = "a text without points",
                 .path = file_.path(),
                 .offset = file_.size_bytes(),
                 .found = "neither rows nor names of columns"});
  return head;
}

/// Names given by the user, of a header line, of a comment; none if they are to be recognised.
std::vector<std::string> TextReader::names_of(const Head& head, std::size_t columns,
                                              const LineReader& lines,
                                              const ScanOptions& options) const {
  const bool given = !options.columns.empty();
  std::vector<std::string> names = given ? options.columns : head.names;
  if (names.empty() && head.comment.size() == columns) names = head.comment;
  if (names.empty()) return names;
  if (head.has_row && names.size() != columns) {
    if (ends_with_empty_field(lines.line(), rows_.separator) && names.size() == columns + 1)
      refuse_count(lines, rows_.separator, names.size());
    lines.refuse(
        given ? "the columns given are not those of the file" : "names and values differ in number",
        fmt::format("{} values", columns), fmt::format("{}", names.size()));
  }
  if (!find_position(names))
    throw_input({.what = "the columns given tell no position",
                 .path = file_.path(),
                 .expected = "x, y and z among them"});
  return names;
}

RowPass TextReader::count_rows(LineReader& lines, const Head& head, std::vector<ColumnUse> uses,
                               const ScanOptions& options) {
  RowPass pass(rows_.separator, std::move(uses));
  Promise promise(head.count);
  bool cut = false;
  for (bool more = head.has_row; more; more = lines.next()) {
    // What the end of the file cuts off is the begin of a row rather than a count.
    if (head.count && lines.was_ended() && has_one_field(lines.line(), rows_.separator)) {
      begin_block(promise, lines, rows_.separator);
      continue;
    }
    // What the end of the file cuts off may have lost digits, unless it is the last of the promised.
    cut = !lines.was_ended() && (promise.left() > 1 || !pass.is_whole_row(lines.line()));
    if (cut && options.allow_truncated) break;
    if (cut && promise.is_kept())
      lines.refuse("the last row is cut off or damaged", lines.line(), "a whole row");
    if (cut) break;
    pass.add(lines);
    promise.add_row();
  }
  if (!promise.is_kept() && !options.allow_truncated)
    throw_input({.what = "the file ends before its last point",
                 .path = file_.path(),
                 .offset = file_.size_bytes(),
                 .found = fmt::format("{} whole rows", pass.rows()),
                 .expected = fmt::format("{}", promise.claimed())});
  info_.claimed_points = promise.claimed() + (cut && promise.is_kept() ? 1 : 0);
  return pass;
}

void TextReader::lay_out(const std::vector<std::string>& names, const TextColumns& columns) {
  auto layout = make_text_layout(names, columns, info_.schema);
  CAIRN_CHECK(layout.has_value());
  rows_.layout = std::move(*layout);
  info_.format = fmt::format("{} of {} columns", is_pts_ ? "PTS" : "text", names.size());
}

std::uint64_t TextReader::stretch_capacity(std::size_t stretch) const {
  return stretches_.at(stretch).rows;
}

void TextReader::read(std::size_t stretch, const BlockSink& sink) const {
  read_text_rows(file_, stretches_.at(stretch), rows_, info_.schema, sink);
}

}  // namespace cairn::formats
