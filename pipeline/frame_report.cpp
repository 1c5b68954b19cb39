#include "pipeline/frame_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "pipeline/human.h"
#include "pipeline/json_number.h"

namespace cairn::pipeline {
namespace {

using Json = nlohmann::ordered_json;
using viewer::FrameStatistics;

std::string bound_text(const FrameStatistics& frame) {
  const auto pixels = [](double bound) { return significant(bound, 3) + " pixels"; };
  if (std::isfinite(frame.pixel_bound)) return pixels(frame.pixel_bound);
  if (std::isfinite(frame.inner_bound))
    return pixels(frame.inner_bound) + ", but for those of leaves that the eye is in";
  return "no bound: points lie as near to the eye as their error";
}

Json vector_json(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

std::vector<std::string> effects_of(const viewer::FramePlan& plan) {
  std::vector<std::string> effects;
  if (plan.lighting) effects.emplace_back("lighting");
  if (plan.cull_back_faces) effects.emplace_back("back-face culling");
  return effects;
}

Json facts_json(const PictureFacts& facts, const viewer::FramePlan& plan) {
  return {{"mode", facts.mode},
          {"size", {facts.view.size().width, facts.view.size().height}},
          {"passes", viewer::passes_of(plan)},
          {"effects", effects_of(plan)},
          {"color", viewer::name_of(plan.color)},
          {"sections", facts.sections}};
}

Json network_json(const NetworkFacts& facts) {
  const formats::AccessStatistics& access = facts.access;
  return {{"requests", access.requests},
          {"retries", access.retries},
          {"fetched_bytes", access.fetched_bytes},
          {"gap_bytes", access.gap_bytes},
          {"repeated_bytes", access.repeated_bytes},
          {"cache_hits", access.cache_hits},
          {"cache_bytes", access.cache_bytes},
          {"drawn_bytes", facts.drawn_bytes},
          {"first_picture_s", facts.first_picture_s},
          {"full_front_s", facts.full_front_s ? Json(*facts.full_front_s) : Json(nullptr)}};
}

std::string network_text(const NetworkFacts& facts) {
  return fmt::format(
      "  network  {} in {}, {}; {} kept from before; first picture after {:.2f} s{}\n",
      human_bytes(facts.access.fetched_bytes), count_of(facts.access.requests, "request"),
      fmt::format("{} {}", facts.access.retries, facts.access.retries == 1 ? "retry" : "retries"),
      human_bytes(facts.access.cache_bytes), facts.first_picture_s,
      facts.full_front_s ? fmt::format(", all of it after {:.2f} s", *facts.full_front_s) : "");
}

/// The value below which this share of them lies. Requires values.
double quantile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

}  // namespace

Json camera_json(const viewer::Camera& camera) {
  return {{"eye", vector_json(camera.eye)},
          {"target", vector_json(camera.target)},
          {"up", vector_json(camera.up)},
          {"fov", camera.fov_y_degrees}};
}

std::string frame_json(const FrameStatistics& frame, const PictureFacts& facts) {
  Json json{
      {"frames", facts.frames},
      {"points", frame.points},
      {"unseen_points", frame.unseen_points},
      {"nodes", frame.nodes},
      {"nodes_on_level", frame.nodes_on_level},
      {"pixel_bound", finite_or_null(frame.pixel_bound)},
      {"inner_pixel_bound", finite_or_null(frame.inner_bound)},
      {"loads", frame.loads},
      {"forced_loads", frame.forced_loads},
      {"hits", frame.hits},
      {"damaged", frame.damaged},
      {"unreachable", frame.unreachable},
      {"culled",
       {{"outside", frame.outside}, {"facing_away", frame.facing_away}, {"hidden", frame.hidden}}},
      {"select_ms", frame.select_ms},
      {"draw_ms", frame.draw_ms},
      {"camera", camera_json(facts.view.camera())}};
  json.update(facts_json(facts, frame.plan));
  if (facts.network) json["network"] = network_json(*facts.network);
  return json.dump() + "\n";
}

std::string frame_text(const FrameStatistics& frame, const PictureFacts& facts) {
  std::string levels;
  for (std::size_t level = 0; level < frame.nodes_on_level.size(); ++level)
    levels += fmt::format("{}{}", level == 0 ? "" : " + ", frame.nodes_on_level[level]);
  std::string text = fmt::format(
      "  points   {} of {} ({} by level, from the coarsest)\n"
      "  error    no input point is drawn farther from where it belongs than: {}\n"
      "  passes   {}; colored by {}{}\n"
      "  read     {}: {}\n"
      "  time     {:.1f} ms to select, {:.1f} ms to draw ({})\n",
      with_commas(frame.points), count_of(frame.nodes, "node"), levels, bound_text(frame),
      fmt::join(viewer::passes_of(frame.plan), ", "), viewer::name_of(frame.plan.color),
      effects_of(frame.plan).empty()
          ? ""
          : "; " + fmt::format("{}", fmt::join(effects_of(frame.plan), ", ")),
      count_of(frame.loads, "node"), fmt::join(facts.sections, ", "), frame.select_ms,
      frame.draw_ms, facts.mode);
  if (frame.damaged > 0)
    text += fmt::format("  damaged  {}, drawn by what stands for them\n",
                        count_of(frame.damaged, "node"));
  if (frame.unreachable > 0)
    text +=
        fmt::format("  missing  {} that the network did not bring, drawn by what stands for them\n",
                    count_of(frame.unreachable, "node"));
  if (facts.network) text += network_text(*facts.network);
  return text;
}

void WalkReport::add(double time_s, const FrameStatistics& frame, double elapsed_s,
                     std::uint64_t fetched_bytes) {
  rows_.push_back({time_s, frame, elapsed_s, fetched_bytes});
}

std::string WalkReport::csv() const {
  std::string text =
      "frame,time_s,points,nodes,loads,forced_loads,hits,missing,finest,pixel_bound,select_ms,draw_"
      "ms";
  text += network_ ? ",elapsed_s,fetched_bytes\n" : "\n";
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const FrameStatistics& frame = rows_[i].frame;
    text += fmt::format("{},{:.4f},{},{},{},{},{},{},{},{:.3f},{:.3f},{:.3f}", i, rows_[i].time_s,
                        frame.points, frame.nodes, frame.loads, frame.forced_loads, frame.hits,
                        frame.missing, frame.finest ? 1 : 0, frame.pixel_bound, frame.select_ms,
                        frame.draw_ms);
    if (network_) text += fmt::format(",{:.4f},{}", rows_[i].elapsed_s, rows_[i].fetched_bytes);
    text += '\n';
  }
  return text;
}

std::string WalkReport::summary_text(const PictureFacts& facts) const {
  const Json json = Json::parse(summary_json(facts));
  const auto spread = [&](const char* key, const char* format) {
    return fmt::format(fmt::runtime(format), json[key]["least"].get<double>(),
                       json[key]["median"].get<double>(), json[key]["greatest"].get<double>());
  };
  std::string text = fmt::format(
      "  frames   {}, {} nodes read, {} of them waited for, {} hits, {} frames stood in for\n"
      "  points   {}\n"
      "  select   {}\n"
      "  draw     {} ({})\n",
      rows_.size(), json["loads"].get<std::uint64_t>(), json["forced_loads"].get<std::uint64_t>(),
      json["hits"].get<std::uint64_t>(), json["frames_stood_in"].get<std::uint64_t>(),
      spread("points", "{:.0f} least, {:.0f} median, {:.0f} greatest"),
      spread("select_ms", "{:.2f} ms least, {:.2f} median, {:.2f} greatest"),
      spread("draw_ms", "{:.1f} ms least, {:.1f} median, {:.1f} greatest"), facts.mode);
  if (facts.network) text += network_text(*facts.network);
  return text;
}

std::string WalkReport::summary_json(const PictureFacts& facts) const {
  const auto spread = [&](auto value) {
    std::vector<double> values;
    for (const Row& row : rows_) values.push_back(static_cast<double>(value(row.frame)));
    return Json{{"least", quantile(values, 0)},
                {"median", quantile(values, 0.5)},
                {"greatest", quantile(values, 1)}};
  };
  const auto sum = [&](auto value) {
    std::uint64_t total = 0;
    for (const Row& row : rows_) total += value(row.frame);
    return total;
  };
  Json json{
      {"frames", rows_.size()},
      {"points", spread([](const FrameStatistics& f) { return f.points; })},
      {"nodes", spread([](const FrameStatistics& f) { return f.nodes; })},
      {"select_ms", spread([](const FrameStatistics& f) { return f.select_ms; })},
      {"draw_ms", spread([](const FrameStatistics& f) { return f.draw_ms; })},
      {"loads", sum([](const FrameStatistics& f) { return f.loads; })},
      {"forced_loads", sum([](const FrameStatistics& f) { return f.forced_loads; })},
      {"hits", sum([](const FrameStatistics& f) { return f.hits; })},
      {"frames_stood_in", sum([](const FrameStatistics& f) { return f.missing > 0 ? 1u : 0u; })},
      {"damaged", rows_.back().frame.damaged}};
  json.update(facts_json(facts, rows_.back().frame.plan));
  if (facts.network) json["network"] = network_json(*facts.network);
  return json.dump() + "\n";
}

}  // namespace cairn::pipeline
