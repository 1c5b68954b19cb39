#include "viewer/window/panel.h"

#include <epoxy/gl.h>
#include <fmt/format.h>
#include <imgui/backends/imgui_impl_glfw.h>
#include <imgui/backends/imgui_impl_opengl3.h>
#include <imgui/imgui.h>

#include "formats/error.h"
#include "viewer/window/input.h"

namespace cairn::viewer {
namespace {

constexpr float kFontPixels = 13;  ///< the size that the built-in font is drawn for

float text_scale() { return ImGui::GetFontSize() / kFontPixels; }

void set_style(float scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 4;
  style.FrameRounding = 2;
  style.GrabRounding = 2;
  style.Colors[ImGuiCol_WindowBg].w = 0.88f;
  style.ScaleAllSizes(scale);
  ImFontConfig font;
  font.SizePixels = kFontPixels * scale;
  ImGui::GetIO().Fonts->AddFontDefault(&font);
}

void draw_help(bool& open) {
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x / 2, screen.y / 2}, ImGuiCond_Appearing, {0.5f, 0.5f});
  if (ImGui::Begin("Help", &open,
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse) &&
      ImGui::BeginTable("keys", 2)) {
    for (const HelpLine& line : kHelpLines) {
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      ImGui::TextColored({0.95f, 0.8f, 0.45f, 1}, "%s", line.keys.data());
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(line.effect.data());
    }
    ImGui::EndTable();
  }
  ImGui::End();
}

/// At the bottom, so that it is seen where the panels are hidden.
void draw_message(const std::string& message) {
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({screen.x / 2, screen.y - 10}, ImGuiCond_Always, {0.5f, 1});
  if (ImGui::Begin("message", nullptr,
                   ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                       ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoFocusOnAppearing))
    ImGui::TextUnformatted(message.c_str());
  ImGui::End();
}

}  // namespace

Panel::Panel(Window& window) {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // leaves no file behind
  set_style(window.content_scale());
  CAIRN_CHECK(ImGui_ImplGlfw_InitForOpenGL(window.handle(), /*install_callbacks=*/true));
  CAIRN_CHECK(ImGui_ImplOpenGL3_Init("#version 450 core"));
}

Panel::~Panel() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
}

void Panel::begin() {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}

bool Panel::takes_mouse() const { return ImGui::GetIO().WantCaptureMouse; }

void Panel::draw(ViewState& state, const PanelFacts& facts, Actions& actions) {
  if (state.panel) {
    draw_controls(state, facts, actions, text_scale());
    draw_statistics(facts, text_scale());
  }
  if (state.help) draw_help(state.help);
  if (!facts.message.empty()) draw_message(facts.message);
  ImGui::Render();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

std::string short_count(double count) {
  if (count < 1e3) return fmt::format("{:.0f}", count);
  const auto three_digits = [](double number, const char* unit) {
    return fmt::format("{:.{}f} {}", number, number < 9.995 ? 2 : number < 99.95 ? 1 : 0, unit);
  };
  if (count < 999.5e3) return three_digits(count / 1e3, "k");
  if (count < 999.5e6) return three_digits(count / 1e6, "M");
  return three_digits(count / 1e9, "G");
}

}  // namespace cairn::viewer
