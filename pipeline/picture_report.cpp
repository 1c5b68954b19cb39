#include "pipeline/picture_report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "pipeline/frame_report.h"
#include "pipeline/human.h"
#include "pipeline/json_number.h"

namespace cairn::pipeline {
namespace {

using Json = nlohmann::ordered_json;
using viewer::PictureDifference;
using viewer::SelectionLimits;

std::string_view name_of_mode(const DrawMode& mode) {
  return mode ? viewer::name_of(*mode) : "auto";
}

std::string budget_text(std::uint64_t budget) {
  return budget == SelectionLimits::kUnlimited ? "all" : with_commas(budget);
}

std::string percent(double share) { return fmt::format("{:.2f} %", 100 * share); }

/// What stands in a row of the table before and behind the differences.
struct Row {
  std::string view;
  DrawMode draw;
  std::uint64_t budget;
  double points;
  std::string_view primitive;
  double select_ms, draw_ms;
};

Row row_of(const DrawnPicture& drawn) {
  return {std::to_string(drawn.view + 1),
          drawn.draw,
          drawn.budget,
          static_cast<double>(drawn.points),
          viewer::name_of(drawn.primitive),
          drawn.select_ms,
          drawn.draw_ms};
}

/// `difference`: null for a full picture.
std::string line_of(const Row& row, const PictureDifference* difference) {
  std::string measures =
      fmt::format("{:>8}  {:>7}  {:>8}  {:>8}  {:>8}  {:>6}", "-", "-", "-", "-", "-", "-");
  if (difference != nullptr)
    measures = fmt::format("{:>8.2f}  {:>7.4f}  {:>8}  {:>8}  {:>8}  {:>6.2f}", difference->psnr(),
                           difference->ssim, percent(difference->holes), percent(difference->extra),
                           percent(difference->differ), difference->noise);
  return fmt::format("  {:>4}  {:>6}  {:>12}  {:>12}  {:>8}  {}  {:>9.2f}  {:>7.1f}\n", row.view,
                     name_of_mode(row.draw), budget_text(row.budget),
                     with_commas(static_cast<std::uint64_t>(std::llround(row.points))),
                     row.primitive, measures, row.select_ms, row.draw_ms);
}

Json difference_json(const PictureDifference& difference) {
  return {{"psnr", finite_or_null(difference.psnr())},
          {"mse", difference.mse},
          {"ssim", finite_or_null(difference.ssim)},
          {"holes", difference.holes},
          {"extra", difference.extra},
          {"differ", difference.differ},
          {"noise", difference.noise}};
}

Json budget_json(std::uint64_t budget) {
  return budget == SelectionLimits::kUnlimited ? Json(nullptr) : Json(budget);
}

Json drawn_json(const DrawnPicture& drawn) {
  return {{"budget", budget_json(drawn.budget)},
          {"draw", name_of_mode(drawn.draw)},
          {"view", drawn.view + 1},
          {"drawn_as", viewer::name_of(drawn.primitive)},
          {"points", drawn.points},
          {"select_ms", drawn.select_ms},
          {"draw_ms", drawn.draw_ms}};
}

Json mean_json(const MeanPictureError& mean) {
  Json json{{"budget", budget_json(mean.budget)},
            {"draw", name_of_mode(mean.draw)},
            {"points", mean.points},
            {"select_ms", mean.select_ms},
            {"draw_ms", mean.draw_ms}};
  json.update(difference_json(mean.difference));
  return json;
}

}  // namespace

std::string pictures_text(const PictureReport& report) {
  std::string text = fmt::format(
      "\nPictures of {} x {} pixels on a budget, against those of all that is visible\n"
      "  {:>4}  {:>6}  {:>12}  {:>12}  {:>8}  {:>8}  {:>7}  {:>8}  {:>8}  {:>8}  {:>6}  {:>9}  "
      "{:>7}\n",
      report.size.width, report.size.height, "view", "draw", "budget", "points", "drawn as",
      "PSNR, dB", "SSIM", "holes", "extra", "differ", "noise", "select ms", "draw ms");
  const std::size_t budgets = report.errors.size() / report.full.size();
  for (std::size_t i = 0; i < report.full.size(); ++i) {
    text += line_of(row_of(report.full[i]), nullptr);
    for (std::size_t budget = 0; budget < budgets; ++budget) {
      const PictureError& error = report.errors[i * budgets + budget];
      text += line_of(row_of(error.drawn), &error.difference);
    }
  }
  for (const MeanPictureError& mean : report.means)
    text += line_of({"mean", mean.draw, mean.budget, mean.points, "", mean.select_ms, mean.draw_ms},
                    &mean.difference);
  return text;
}

Json pictures_json(const PictureReport& report) {
  Json views = Json::array(), full = Json::array(), errors = Json::array(), means = Json::array();
  for (const viewer::Camera& camera : report.views) views.push_back(camera_json(camera));
  for (const DrawnPicture& drawn : report.full) full.push_back(drawn_json(drawn));
  for (const PictureError& error : report.errors) {
    errors.push_back(drawn_json(error.drawn));
    errors.back().update(difference_json(error.difference));
  }
  for (const MeanPictureError& mean : report.means) means.push_back(mean_json(mean));
  return {{"size", {report.size.width, report.size.height}},
          {"views", std::move(views)},
          {"full", std::move(full)},
          {"errors", std::move(errors)},
          {"means", std::move(means)}};
}

}  // namespace cairn::pipeline
