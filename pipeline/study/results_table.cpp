#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "pipeline/human.h"
#include "pipeline/study/results_files.h"

namespace cairn::pipeline {
namespace {

struct Column {
  std::string heading;
  std::function<std::string(const StudyResult&)> text;
};

/// A metric's median with that many digits behind the point.
Column fixed(std::string heading, std::string name, int digits) {
  return {std::move(heading), [name = std::move(name), digits](const StudyResult& result) {
            const auto value = result.value(name);
            return value ? fmt::format("{:.{}f}", *value, digits) : "-";
          }};
}

/// With that many digits that count; `factor` is 100 for a share in percent.
Column rounded(std::string heading, std::string name, int digits, double factor = 1) {
  return {std::move(heading), [name = std::move(name), digits, factor](const StudyResult& result) {
            const auto value = result.value(name);
            return value ? significant(factor * *value, digits) : "-";
          }};
}

std::vector<Column> columns_of(const StudyResults& results) {
  const auto setting = [&](const StudyResult& r) { return results.settings[r.setting].label; };
  const auto drawn = [&](const StudyResult& r) {
    const auto points = r.value("points_drawn");
    return points ? fmt::format("{:.1f} %", 100 * *points / r.errors.leaf_points) : "-";
  };
  const auto spread = [](const StudyResult& r) {
    const MetricSummary* build = r.find("build_s");
    return build != nullptr ? fmt::format("{:.2f} - {:.2f}", build->min, build->max) : "-";
  };
  const auto front = [&](const StudyResult& r) {
    return std::string(on_front(results, r, "build_s", "rms") ? "*" : "");
  };
  std::vector<Column> columns{{"setting", setting},
                              {"drawn", drawn},
                              rounded("rms", "rms", 4),
                              rounded("99 % within", "percentile_99", 4),
                              rounded("largest", "largest", 4),
                              rounded("nearest rms", "nearest_rms", 4),
                              rounded("uncovered %", "uncovered", 3, 100),
                              rounded("overdraw", "overdraw", 3),
                              fixed("bytes/point", "bytes_per_point", 2),
                              fixed("build s", "build_s", 2),
                              {"least - most", spread},
                              fixed("CPU s", "build_cpu_s", 2),
                              fixed("cluster s", "cluster_s", 2),
                              {"front", front}};
  for (const MetricSummary& metric : all_metrics(results))
    if (metric.name.starts_with("psnr@"))
      columns.insert(columns.end() - 1, fixed(metric.name, metric.name, 1));
  return columns;
}

using Row = std::vector<std::string>;

/// Texts to the left, numbers to the right; the line below the heading says so to Markdown.
std::string aligned(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths(rows.front().size(), 3);
  for (const Row& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  std::string text;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t c = 0; c < widths.size(); ++c)
      text += c == 0 ? fmt::format("| {:<{}} |", rows[r][c], widths[c])
                     : fmt::format(" {:>{}} |", rows[r][c], widths[c]);
    text += "\n";
    for (std::size_t c = 0; r == 0 && c < widths.size(); ++c)
      text += c == 0 ? "|" + std::string(widths[c] + 2, '-') + "|"
                     : std::string(widths[c] + 1, '-') + ":|";
    if (r == 0) text += "\n";
  }
  return text;
}

}  // namespace

std::string results_table(const StudyResults& results) {
  std::string text =
      fmt::format("# {}\n\nErrors at {}, in units of the coordinates; medians of {}, {}.\n",
                  results.name, place_words(results.at),
                  count_of(results.repetitions, "repetition"), count_of(results.threads, "thread"));
  const std::vector<Column> columns = columns_of(results);
  for (std::size_t input = 0; input < results.inputs.size(); ++input) {
    std::vector<Row> rows(1);
    for (const Column& column : columns) rows.front().push_back(column.heading);
    std::string failures;
    for (const StudyResult& result : results.results) {
      if (result.input != input) continue;
      rows.emplace_back();
      for (const Column& column : columns) rows.back().push_back(column.text(result));
      if (!result.failure.empty())
        failures += fmt::format("\n{} failed: {}\n", results.settings[result.setting].label,
                                printable(result.failure));
    }
    text +=
        fmt::format("\n## {}: {}\n\n", results.inputs[input].name,
                    count_of(static_cast<std::uint64_t>(results.inputs[input].points), "point"));
    text += aligned(rows) + failures;
  }
  return text;
}

}  // namespace cairn::pipeline
