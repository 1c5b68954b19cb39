#include "pipeline/study/study_inputs.h"

#include <fmt/format.h>

#include <span>
#include <string>

#include "formats/checksum.h"
#include "formats/random_access_file.h"
#include "formats/toml_text.h"
#include "pipeline/scene_file.h"
#include "pipeline/simulate.h"
#include "pipeline/study/study_files.h"

namespace cairn::pipeline {
namespace {

namespace fs = std::filesystem;

/// All that a scene file leads to: its text, those of its base and its meshes.
void add_file(const fs::path& file, formats::RunningChecksum& checksum) {
  const formats::RandomAccessFile opened(file);
  std::vector<std::byte> bytes(opened.size_bytes());
  opened.read_exactly(0, bytes);
  checksum.add(bytes);
}

void add_scene(const fs::path& file, formats::RunningChecksum& checksum) {
  add_file(file, checksum);
  const toml::table scene = formats::parse_toml(formats::read_toml_text(file), file.string());
  if (const auto base = scene["base"].value<std::string>())
    add_scene(file.parent_path() / *base, checksum);
  const toml::array* objects = scene["object"].as_array();
  for (std::size_t i = 0; objects != nullptr && i < objects->size(); ++i)
    if (const auto mesh = toml::node_view((*objects)[i])["path"].value<std::string>())
      add_file(file.parent_path() / *mesh, checksum);
}

std::string key_of(const StudyInput& input) {
  formats::RunningChecksum checksum;
  add_scene(*input.scene, checksum);
  return fmt::format("{:016x} {:016x} {}\n", program_checksum(), checksum.value(),
                     input.points.value_or(0));
}

/// Beside the folder of an input's scans; tells what scene they were made of.
fs::path key_file(const fs::path& folder) { return folder.string() + ".key"; }

void simulate_once(const StudyInput& input, const fs::path& folder, unsigned threads,
                   stages::ProgressSink& progress, const std::stop_token& stop) {
  const SceneFile scene = read_scene(*input.scene);  // refuses what the key need not understand
  const std::string key = key_of(input);
  if (fs::exists(folder) && read_text(key_file(folder)) == key) return;
  fs::remove(key_file(folder));
  simulate(scene, {.output = folder, .points = input.points, .threads = threads, .force = true},
           &progress, stop);
  write_durably(key_file(folder), key);
}

}  // namespace

PreparedInput prepare_input(const StudyInput& input, const fs::path& scans_folder, unsigned threads,
                            stages::ProgressSink& progress, const std::stop_token& stop) {
  PreparedInput prepared;
  prepared.config = input.campaign;
  if (input.folder) prepared.values["folder"] = {{input.folder->string()}, "folder"};
  if (input.scans) prepared.values["scans"] = *input.scans;
  if (input.scene) {
    const fs::path folder = scans_folder / input.name;
    simulate_once(input, folder, threads, progress, stop);
    prepared.config = folder / "campaign.toml";
  }
  return prepared;
}

BuildOptions options_of(const PreparedInput& input, const StudySetting& setting) {
  SettingLayer values = setting.values;
  values.insert(input.values.begin(), input.values.end());
  values["output"] = {{"dataset.cairn"}, "output"};
  return resolve_settings(values, input.config).options;
}

}  // namespace cairn::pipeline
