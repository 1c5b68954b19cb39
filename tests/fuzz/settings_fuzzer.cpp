// Hostile TOML: the configuration of a campaign, the scene of a simulation, the walk of a camera, a study.
#include <string_view>

#include "pipeline/config.h"
#include "pipeline/scene_file.h"
#include "pipeline/study/study_file.h"
#include "tests/fuzz/fuzz_target.h"
#include "viewer/walk_file.h"

namespace cairn::fuzz {
namespace {

using formats::ErrorKind;

void resolve(std::string_view text) {
  pipeline::SettingLayer layer = pipeline::parse_config(text, "fuzz.toml", "/");
  layer.erase("scans");  // may be a pattern of names, which is looked up on the disk
  pipeline::resolve_settings(layer, std::nullopt);
}

/// What is written of a walk is the walk that was read.
void play(std::string_view text) {
  const viewer::Walk walk = viewer::parse_walk(text, "fuzz.toml");
  const std::string written = viewer::walk_text(walk);
  require(viewer::walk_text(viewer::parse_walk(written, "fuzz.toml")) == written);
}

}  // namespace

void run(std::span<const std::byte> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  accepts({ErrorKind::kUsage}, [&] { resolve(text); });
  accepts({ErrorKind::kUsage}, [&] { play(text); });
  accepts({ErrorKind::kUsage}, [&] { pipeline::parse_study(text, "fuzz.toml"); });
  // The shape of a statue takes 50 ms to make, and no number of the scene decides how.
  if (text.find("statue") != text.npos) return;
  // A scene may name files of meshes.
  accepts({ErrorKind::kUsage, ErrorKind::kInput, ErrorKind::kSystem},
          [&] { pipeline::parse_scene(text, "fuzz.toml"); });
}

}  // namespace cairn::fuzz
