#include "formats/scans/ptx_reader.h"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "formats/error.h"
#include "formats/random_access_file.h"
#include "formats/scans/parse_number.h"
#include "formats/scans/text_rows.h"

namespace cairn::formats {
namespace {

// Values on each line of a header.
constexpr std::array<std::size_t, 10> kHeaderValues{1, 1, 3, 3, 3, 3, 4, 4, 4, 4};
constexpr std::size_t kMatrixLine = 6;
// A reader of its own for each: far more than any file has, few enough for the memory.
constexpr std::size_t kMostScans = 65536;

struct Section {
  std::uint64_t columns = 0, rows = 0;
  std::uint64_t cells = 0;  ///< columns * rows
  Pose pose;
  std::uint64_t present = 0;
  std::size_t fields = 4;
  Separator separator = Separator::kBlanks;
  TextColumns values;
  std::vector<TextStretch> stretches;
};

std::vector<double> numbers_in(std::string_view line) {
  const Separator separator = separator_of(line);
  std::vector<double> numbers;
  for (std::string_view field; next_field(line, separator, field);) {
    double& value = numbers.emplace_back();
    if (!parse_number(field, ScalarType::kF64, reinterpret_cast<std::byte*>(&value))) return {};
  }
  return numbers;
}

/// Cells along one side of the grid.
std::uint64_t size_in(const LineReader& lines) {
  std::string_view rest = lines.line(), field;
  std::uint64_t size = 0;
  if (!next_field(rest, separator_of(rest), field) ||
      !parse_number(field, ScalarType::kU64, reinterpret_cast<std::byte*>(&size)))
    lines.refuse("damaged size of the grid", lines.line(), "a whole number");
  return size;
}

/// Fills column `line` of the linear part, or the translation, from a row of the matrix.
void set_matrix_row(Pose& pose, std::size_t row, const std::vector<double>& values,
                    const LineReader& lines) {
  constexpr double kTolerance = 1e-6;
  if (!(std::fabs(values[3] - (row == 3 ? 1 : 0)) <= kTolerance))
    lines.refuse("the matrix of the scan is no pose", lines.line(), "a last column of 0, 0, 0, 1");
  for (std::size_t axis = 0; axis < 3; ++axis)
    (row == 3 ? pose.translation[axis] : pose.linear[axis][row]) = values[axis];
}

/// Reads a header whose first line `lines` stands on.
Section read_header(LineReader& lines) {
  Section section;
  for (std::size_t i = 0; i < kHeaderValues.size(); ++i) {
    if (i > 0 && !lines.next())
      lines.refuse("the file ends inside the header of a scan", "", "ten lines");
    const std::vector<double> values = numbers_in(lines.line());
    if (values.size() != kHeaderValues[i])
      lines.refuse("damaged header of a scan", lines.line(),
                   fmt::format("{} numbers", kHeaderValues[i]));
    if (i == 0) section.columns = size_in(lines);
    if (i == 1) section.rows = size_in(lines);
    if (i >= kMatrixLine) set_matrix_row(section.pose, i - kMatrixLine, values, lines);
  }
  if (__builtin_mul_overflow(section.columns, section.rows, &section.cells))
    lines.refuse("the grid has more cells than can be counted",
                 fmt::format("{} x {}", section.columns, section.rows), "a smaller grid");
  return section;
}

std::vector<ColumnUse> cell_uses(std::size_t fields) {
  std::vector<ColumnUse> uses(fields, ColumnUse::kLookedAt);
  std::fill_n(uses.begin(), 3, ColumnUse::kPosition);
  return uses;
}

/// Passes over the cells of a section, up to its last or the end of the file.
void read_cells(LineReader& lines, Section& section) {
  if (section.cells == 0 || !lines.next()) return;
  section.separator = separator_of(lines.line());
  section.fields = count_fields(lines.line(), section.separator);
  if (section.fields != 4 && section.fields != 7 && lines.was_ended())
    lines.refuse("a cell has a wrong number of values", fmt::format("{}", section.fields),
                 "4 or 7");
  if (section.fields != 7) section.fields = 4;
  RowPass pass(section.separator, cell_uses(section.fields));
  do {
    // What the end of the file cuts off may have lost digits, unless it is the last cell.
    const bool last = pass.rows() + 1 == section.cells;
    if (!lines.was_ended() && !(last && pass.is_whole_row(lines.line()))) break;
    pass.add(lines);
  } while (pass.rows() < section.cells && lines.next());
  section.present = pass.rows();
  section.values = pass.columns();
  section.stretches = std::move(pass).stretches();
}

std::vector<Section> read_sections(const RandomAccessFile& file, const ScanOptions& options) {
  LineReader lines(file, text_start(file));
  std::vector<Section> sections;
  while (lines.next()) {
    if (sections.size() == kMostScans)
      lines.refuse("too many scans in one file", "one more", fmt::format("at most {}", kMostScans));
    Section& section = sections.emplace_back(read_header(lines));
    read_cells(lines, section);
    if (section.present < section.cells && !options.allow_truncated)
      throw_input(
          {.what = fmt::format("the file ends before the last cell of scan {}", sections.size()),
           .path = file.path(),
           .offset = file.size_bytes(),
           .found = fmt::format("{} cells", section.present),
           .expected = fmt::format("{} x {}", section.columns, section.rows)});
    if (section.present < section.cells) break;
  }
  if (sections.empty())
    throw_input({.what = "a PTX file without a scan",
                 .path = file.path(),
                 .offset = file.size_bytes(),
                 .expected = "a header of ten lines"});
  return sections;
}

class PtxScan final : public ScanReader {
 public:
  /// `values` are those of all scans of the file, so that all have the same types.
  PtxScan(std::shared_ptr<const RandomAccessFile> file, Section section, const TextColumns& values)
      : file_(std::move(file)), stretches_(std::move(section.stretches)) {
    info_.path = file_->path();
    info_.format = fmt::format("PTX of {} x {} cells", section.columns, section.rows);
    info_.encoding = PositionEncoding::kFloat64;
    info_.guesses_color_width = true;
    info_.claimed_points = section.cells;
    info_.present_points = section.present;
    info_.pose = section.pose;
    info_.sensor = Vector3{};
    std::vector<std::string> names{"x", "y", "z", "intensity", "red", "green", "blue"};
    names.resize(section.fields);
    auto layout = make_text_layout(names, values, info_.schema);
    CAIRN_CHECK(layout.has_value());
    rows_ = {section.separator, std::move(*layout), /*counts_between=*/false, /*gridded=*/true};
  }

  void set_part(std::string part) { info_.part = std::move(part); }

  std::size_t stretch_count() const override { return stretches_.size(); }
  std::uint64_t stretch_capacity(std::size_t stretch) const override {
    return stretches_.at(stretch).rows;
  }
  void read(std::size_t stretch, const BlockSink& sink) const override {
    read_text_rows(*file_, stretches_.at(stretch), rows_, info_.schema, sink);
  }

 private:
  std::shared_ptr<const RandomAccessFile> file_;
  std::vector<TextStretch> stretches_;
  TextRows rows_;
};

}  // namespace

std::vector<std::unique_ptr<ScanReader>> open_ptx(const std::filesystem::path& path,
                                                  const ScanOptions& options) {
  const auto file = std::make_shared<const RandomAccessFile>(path);
  std::vector<Section> sections = read_sections(*file, options);
  TextColumns values;
  values.values.resize(7);
  for (const Section& section : sections)
    for (std::size_t i = 0; i < section.values.values.size(); ++i)
      values.values[i].add(section.values.values[i]);
  std::vector<std::unique_ptr<ScanReader>> scans;
  for (std::size_t i = 0; i < sections.size(); ++i) {
    auto scan = std::make_unique<PtxScan>(file, std::move(sections[i]), values);
    if (sections.size() > 1) scan->set_part(fmt::format("scan {}", i + 1));
    scans.push_back(std::move(scan));
  }
  return scans;
}

bool begins_ptx(std::string_view beginning) {
  std::size_t line = 0;
  while (line < kHeaderValues.size() && !beginning.empty()) {
    const std::size_t end = std::min(beginning.find('\n'), beginning.size());
    const std::string_view text = beginning.substr(0, end);
    beginning.remove_prefix(std::min(end + 1, beginning.size()));
    if (text.find_first_not_of(" \t\r") == std::string_view::npos || is_comment(text)) continue;
    if (numbers_in(text).size() != kHeaderValues[line++]) return false;
  }
  return line == kHeaderValues.size();
}

}  // namespace cairn::formats
