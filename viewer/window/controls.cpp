// The panel of controls.
#include <fmt/format.h>
#include <imgui/imgui.h>

#include <algorithm>
#include <optional>

#include "viewer/window/panel.h"

namespace cairn::viewer {
namespace {

constexpr float kWidth = 330;  ///< pixels of a plain screen

void draw_detail(ViewState& state, const PanelFacts& facts) {
  const BudgetRange& range = facts.budgets;
  std::uint64_t points = std::clamp(state.limits.points, range.least, range.most);
  const std::string text = points >= facts.all_points
                               ? "all points"
                               : short_count(static_cast<double>(points)) + " points";
  constexpr ImGuiSliderFlags kLog = ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_NoInput;
  if (ImGui::SliderScalar("budget", ImGuiDataType_U64, &points, &range.least, &range.most,
                          text.c_str(), kLog))
    state.limits.points = points;
  auto pixels = static_cast<float>(state.limits.pixel_error);
  if (ImGui::SliderFloat("error", &pixels, 0, 20, pixels > 0 ? "at most %.1f px" : "by the budget",
                         ImGuiSliderFlags_NoInput))
    state.limits.pixel_error = std::max(0.0f, pixels);
}

void draw_primitive(std::optional<Primitive>& wish) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted("draw");
  const auto choice = [&](std::optional<Primitive> value, const std::string& name) {
    ImGui::SameLine();
    if (ImGui::RadioButton(name.c_str(), wish == value)) wish = value;
  };
  choice(std::nullopt, "auto");
  for (const Primitive value : {Primitive::kPoints, Primitive::kDiscs, Primitive::kSplats})
    choice(value, std::string(name_of(value)));
}

void draw_color(std::optional<ColorSource>& wish, const PanelFacts& facts) {
  const std::string automatic = fmt::format("auto: {}", name_of(facts.frame.plan.color));
  const std::string now = wish ? std::string(name_of(*wish)) : automatic;
  if (!ImGui::BeginCombo("color", now.c_str())) return;
  if (ImGui::Selectable("auto", !wish)) wish.reset();
  for (const ColorSource source : color_sources())
    if (offers(facts.scene, source) && ImGui::Selectable(name_of(source).data(), wish == source))
      wish = source;
  ImGui::EndCombo();
}

/// A row of a table: automatic (and what that is now), on, off.
void draw_switch(const char* name, std::optional<bool>& wish, bool now, bool possible) {
  ImGui::TableNextRow();
  ImGui::PushID(name);
  ImGui::BeginDisabled(!possible);
  const auto choice = [&](std::optional<bool> value, const char* label) {
    ImGui::TableNextColumn();
    if (ImGui::RadioButton(label, wish == value)) wish = value;
  };
  ImGui::TableNextColumn();
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted(name);
  choice(std::nullopt, wish ? "auto" : now ? "auto: on" : "auto: off");
  choice(true, "on");
  choice(false, "off");
  ImGui::EndDisabled();
  ImGui::PopID();
}

void draw_effects(Wishes& wishes, const PanelFacts& facts) {
  const FramePlan& plan = facts.frame.plan;
  if (!ImGui::BeginTable("effects", 4, ImGuiTableFlags_SizingFixedFit)) return;
  draw_switch("lighting", wishes.lighting, plan.lighting, facts.scene.normals);
  draw_switch("eye-dome", wishes.eye_dome, plan.eye_dome, true);
  draw_switch("cull backs", wishes.cull_back_faces, plan.cull_back_faces, facts.scene.normals);
  draw_switch("occlusion", wishes.occlusion, plan.occlusion_queries, !plan.deferred_blending);
  ImGui::EndTable();
}

void draw_looks(ViewState& state, const PanelFacts& facts) {
  Wishes& wishes = state.wishes;
  const FramePlan& plan = facts.frame.plan;
  draw_primitive(wishes.primitive);
  ImGui::BeginDisabled(plan.primitive != Primitive::kPoints);
  ImGui::SliderFloat("point size", &wishes.point_pixels, 1, 16, "%.0f px",
                     ImGuiSliderFlags_NoInput);
  ImGui::EndDisabled();
  draw_color(wishes.color, facts);
  draw_effects(wishes, facts);
  ImGui::BeginDisabled(plan.primitive != Primitive::kSplats);
  ImGui::Checkbox("blend deferred", &wishes.deferred_blending);
  ImGui::EndDisabled();
  ImGui::SameLine();
  ImGui::Checkbox("boxes", &state.boxes);
  ImGui::SameLine();
  ImGui::Checkbox("prefetch", &state.prefetch);
}

void draw_camera(ViewState& state, const PanelFacts& facts, Actions& actions) {
  const auto button = [&](const char* label, Action action) {
    if (ImGui::Button(label)) actions.push_back(action);
  };
  if (ImGui::RadioButton("orbit", !state.fly)) state.fly = false;
  ImGui::SameLine();
  if (ImGui::RadioButton("fly", state.fly)) state.fly = true;
  ImGui::SameLine();
  ImGui::BeginDisabled(!state.fly);
  auto speed = static_cast<float>(state.fly_speed);
  ImGui::SetNextItemWidth(-1);
  if (ImGui::SliderFloat("##speed", &speed, 1.0f / 64, 64, "speed x %.2f",
                         ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_NoInput))
    state.fly_speed = speed;
  ImGui::EndDisabled();
  button("reset", Action::kResetCamera);
  ImGui::SameLine();
  button("picture", Action::kScreenshot);
  ImGui::SameLine();
  button(facts.recording ? "end walk" : "record walk", Action::kRecord);
  ImGui::SameLine();
  ImGui::BeginDisabled(!facts.has_walk || facts.recording);
  button(facts.replaying ? "stop" : "replay", Action::kReplay);
  ImGui::EndDisabled();
  ImGui::SameLine();
  if (ImGui::Button("help")) state.help = !state.help;
}

}  // namespace

void draw_controls(ViewState& state, const PanelFacts& facts, Actions& actions, float scale) {
  ImGui::SetNextWindowPos({10 * scale, 10 * scale}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSizeConstraints({kWidth * scale, 0},
                                      {kWidth * scale, ImGui::GetIO().DisplaySize.y - 20 * scale});
  if (ImGui::Begin("View", nullptr, ImGuiWindowFlags_AlwaysAutoResize)) {
    ImGui::PushItemWidth(220 * scale);
    draw_detail(state, facts);
    ImGui::Separator();
    draw_looks(state, facts);
    ImGui::Separator();
    draw_camera(state, facts, actions);
    ImGui::PopItemWidth();
  }
  ImGui::End();
}

}  // namespace cairn::viewer
