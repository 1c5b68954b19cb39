// The panel of statistics.
#include <fmt/format.h>
#include <imgui/imgui.h>

#include <cmath>

#include "viewer/point_colors.h"
#include "viewer/window/panel.h"

namespace cairn::viewer {
namespace {

constexpr float kWidth = 280;  ///< pixels of a plain screen

/// A row of a table: a name and what is to be told, in as many lines as it needs.
void row(const char* name, const std::string& text) {
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::TextDisabled("%s", name);
  ImGui::TableNextColumn();
  ImGui::PushTextWrapPos(0);
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
}

std::string megabytes(double bytes) { return fmt::format("{:.0f} MiB", bytes / (1 << 20)); }

std::string count(std::uint64_t number) { return short_count(static_cast<double>(number)); }

std::string bound_text(const FrameStatistics& frame) {
  if (std::isfinite(frame.pixel_bound)) return fmt::format("at most {:.3g} px", frame.pixel_bound);
  if (std::isfinite(frame.inner_bound))
    return fmt::format("at most {:.3g} px\nbut in the nearest leaves", frame.inner_bound);
  return "no bound: too near";
}

void tell_speed(const PanelFacts& facts) {
  const FrameStatistics& frame = facts.frame;
  row("frames/s", facts.frames_per_s > 0 ? fmt::format("{:.1f}{}", facts.frames_per_s,
                                                       facts.resting ? ", resting" : "")
                                         : "none yet");
  row("points/s",
      count(static_cast<std::uint64_t>(facts.frames_per_s * static_cast<double>(frame.points))));
  row("points", fmt::format("{} of {}", count(frame.points), count(facts.all_points)));
  row("error", bound_text(frame));
  row("time", fmt::format("{:.1f} ms select\n{:.1f} ms draw", frame.select_ms, frame.draw_ms));
}

void tell_nodes(const FrameStatistics& frame) {
  row("nodes", fmt::format("{} in use", frame.nodes));
  for (std::size_t level = 0; level < frame.nodes_on_level.size(); ++level) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::TextDisabled("  level %d", static_cast<int>(level));
    ImGui::TableNextColumn();
    const std::uint32_t color = palette_color(static_cast<std::uint32_t>(level));
    ImGui::PushStyleColor(ImGuiCol_Text, ImGui::ColorConvertU32ToFloat4(color));
    ImGui::TextUnformatted("o");
    ImGui::PopStyleColor();
    ImGui::SameLine();
    ImGui::TextUnformatted(fmt::format("{}", frame.nodes_on_level[level]).c_str());
  }
  row("culled", fmt::format("{} outside, {} facing away,\n{} hidden", frame.outside,
                            frame.facing_away, frame.hidden));
}

void tell_loads(const PanelFacts& facts) {
  const FrameStatistics& frame = facts.frame;
  row("cache", fmt::format("{} slots, {}", facts.slots,
                           megabytes(static_cast<double>(facts.slots) *
                                     static_cast<double>(facts.slot_bytes))));
  row("loads", fmt::format("{}, {} waited for", facts.totals.loads, facts.totals.forced_loads));
  row("hits", fmt::format("{}", facts.totals.hits));
  row("missing", fmt::format("{}", frame.missing));
  if (frame.damaged > 0) row("damaged", fmt::format("{}", frame.damaged));
  if (frame.unreachable > 0) row("no answer", fmt::format("{} nodes", frame.unreachable));
}

void tell_network(const formats::AccessStatistics& network) {
  row("fetched", fmt::format("{:.1f} MiB, {} requests,\n{} retries",
                             static_cast<double>(network.fetched_bytes) / (1 << 20),
                             network.requests, network.retries));
  row("kept",
      fmt::format("{:.1f} MiB, {} sections", static_cast<double>(network.cache_bytes) / (1 << 20),
                  network.cache_hits));
}

void tell_plan(const PanelFacts& facts) {
  const FramePlan& plan = facts.frame.plan;
  row("draws",
      fmt::format("{}, color: {}{}{}", name_of(plan.primitive), name_of(plan.color),
                  plan.lighting ? ", lighting" : "", plan.cull_back_faces ? ", backs culled" : ""));
  row("passes", fmt::format("{}", fmt::join(passes_of(plan), ", ")));
  row("reads", fmt::format("{}", fmt::join(facts.sections, ", ")));
}

}  // namespace

void draw_statistics(const PanelFacts& facts, float scale) {
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x - 10 * scale, 10 * scale}, ImGuiCond_Always, {1, 0});
  ImGui::SetNextWindowSizeConstraints({kWidth * scale, 0}, {kWidth * scale, screen.y - 20 * scale});
  if (ImGui::Begin("Statistics", nullptr,
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove |
                       ImGuiWindowFlags_NoFocusOnAppearing) &&
      ImGui::BeginTable("numbers", 2)) {
    ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthFixed, 70 * scale);
    ImGui::TableSetupColumn("text", ImGuiTableColumnFlags_WidthStretch);
    tell_speed(facts);
    tell_nodes(facts.frame);
    tell_loads(facts);
    if (facts.network) tell_network(*facts.network);
    tell_plan(facts);
    ImGui::EndTable();
  }
  ImGui::End();
}

}  // namespace cairn::viewer
