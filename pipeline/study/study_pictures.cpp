#include "pipeline/study/study_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/point_count.h"

namespace cairn::pipeline {
namespace {

/// Equal pictures have no finite PSNR, which JSON could not tell: more than any two that differ.
constexpr double kMostDecibels = 120;

struct PictureMetric {
  const char* name;
  double (*of)(const MeanPictureError& error);
};

// To add what is told of pictures: a row here, and one of kKnownMetrics if more of it is better.
constexpr auto kPictureMetrics = std::to_array<PictureMetric>({
    {"psnr",
     [](const MeanPictureError& e) { return std::min(e.difference.psnr(), kMostDecibels); }},
    {"ssim", [](const MeanPictureError& e) { return e.difference.ssim; }},
    {"holes", [](const MeanPictureError& e) { return e.difference.holes; }},
    {"noise", [](const MeanPictureError& e) { return e.difference.noise; }},
    {"frame_ms", [](const MeanPictureError& e) { return e.select_ms + e.draw_ms; }},
});

std::optional<std::vector<std::string>> some_texts(const toml::node& node) {
  const toml::array* items = node.as_array();
  std::vector<std::string> texts;
  for (std::size_t i = 0; items != nullptr && i < items->size(); ++i) {
    const auto text = any_text((*items)[i]);
    if (!text) return std::nullopt;
    texts.push_back(*text);
  }
  return texts.empty() ? std::nullopt : std::optional(texts);
}

std::optional<std::vector<std::uint64_t>> budgets_of(const toml::node& node) {
  const auto texts = some_texts(node);
  std::vector<std::uint64_t> budgets;
  for (const std::string& text : texts.value_or(std::vector<std::string>{})) {
    const auto points = parse_count(text);
    if (!points || points == kAllPoints || std::ranges::count(budgets, *points) != 0)
      return std::nullopt;
    budgets.push_back(*points);
  }
  return budgets.empty() ? std::nullopt : std::optional(budgets);
}

std::optional<std::vector<DrawMode>> draw_modes_of(const toml::node& node) {
  const auto texts = some_texts(node);
  std::vector<DrawMode> modes;
  for (const std::string& text : texts.value_or(std::vector<std::string>{})) {
    const DrawMode mode = viewer::primitive_named(text);
    if ((!mode && text != "auto") || std::ranges::count(modes, mode) != 0) return std::nullopt;
    modes.push_back(mode);
  }
  return modes.empty() ? std::nullopt : std::optional(modes);
}

std::optional<viewer::PictureSize> size_of(const toml::node& node) {
  const toml::array* sides = node.as_array();
  if (sides == nullptr || sides->size() != 2) return std::nullopt;
  const auto width = whole_number((*sides)[0], 1, viewer::PictureSize::kMaxSide);
  const auto height = whole_number((*sides)[1], 1, viewer::PictureSize::kMaxSide);
  if (!width || !height) return std::nullopt;
  return viewer::PictureSize{static_cast<std::uint32_t>(*width),
                             static_cast<std::uint32_t>(*height)};
}

std::string budget_name(std::uint64_t budget) {
  if (budget % 1'000'000 == 0) return fmt::format("{}M", budget / 1'000'000);
  if (budget % 1'000 == 0) return fmt::format("{}k", budget / 1'000);
  return fmt::format("{}", budget);
}

}  // namespace

PictureOptions read_pictures(CheckedTable table) {
  PictureOptions options{
      .budgets = table.need("budgets",
                            "an array of different numbers of points such as \"200k\" or \"1M\"",
                            budgets_of)};
  options.draw_modes =
      table
          .find("draw", "an array of some of auto, points, discs and splats, each once",
                draw_modes_of)
          .value_or(options.draw_modes);
  options.size = table.find("size", "[width, height], pixels", size_of).value_or(options.size);
  table.finish();
  return options;
}

std::string pictures_key(const PictureOptions& options) {
  std::string key = fmt::format("{}x{}", options.size.width, options.size.height);
  for (const std::uint64_t budget : options.budgets) key += fmt::format(" {}", budget);
  for (const DrawMode& mode : options.draw_modes)
    key += fmt::format(" {}", mode ? viewer::name_of(*mode) : "auto");
  return key;
}

std::vector<Metric> picture_metrics(const PictureReport& report) {
  std::vector<Metric> metrics;
  for (const MeanPictureError& mean : report.means) {
    std::string drawn = budget_name(mean.budget);
    if (mean.draw) drawn += "_" + std::string(viewer::name_of(*mean.draw));
    for (const PictureMetric& metric : kPictureMetrics)
      if (const double value = metric.of(mean); std::isfinite(value))
        metrics.push_back({fmt::format("{}@{}", metric.name, drawn), value});
  }
  return metrics;
}

}  // namespace cairn::pipeline
