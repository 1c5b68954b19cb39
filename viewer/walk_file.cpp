#include "viewer/walk_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "formats/error.h"
#include "formats/part_file.h"
#include "formats/toml_text.h"

namespace cairn::viewer {
namespace {

constexpr std::string_view kNumber = "a finite number";
constexpr std::string_view kTriple = "three finite numbers: [x, y, z]";

std::string number_text(double number) {
  std::string text = fmt::format("{}", number);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::optional<double> number(const toml::node& node) {
  const auto value = node.is_number() ? node.value<double>() : std::nullopt;
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<glm::dvec3> triple(const toml::node& node) {
  const toml::array* items = node.as_array();
  if (items == nullptr || items->size() != 3) return std::nullopt;
  glm::dvec3 values;
  for (int axis = 0; axis < 3; ++axis) {
    const auto value = number((*items)[static_cast<std::size_t>(axis)]);
    if (!value) return std::nullopt;
    values[axis] = *value;
  }
  return values;
}

/// One table of the file: which one, for messages, and its values by key.
class WalkTable {
 public:
  /// Refuses keys that are not among `keys`.
  WalkTable(const toml::table& table, const std::filesystem::path& file, std::string owner,
            std::initializer_list<std::string_view> keys)
      : table_(table), file_(file), owner_(std::move(owner)) {
    for (const auto& [key, node] : table_) {
      if (std::find(keys.begin(), keys.end(), key.str()) != keys.end()) continue;
      formats::throw_usage(fmt::format("{}: unknown key '{}'; keys are {}", place(node), key.str(),
                                       fmt::join(keys, ", ")));
    }
  }

  const toml::node* find(std::string_view key) const { return table_.get(key); }

  /// Sets `value` to what `reader` takes from the key's node; without the key it keeps its default, if it `may_miss`.
  template <typename Value, typename Reader>
  void read(std::string_view key, std::string_view expected, Reader reader, Value& value,
            bool may_miss) const {
    const toml::node* node = find(key);
    if (node == nullptr) {
      if (may_miss) return;
      throw formats::Error(formats::ErrorKind::kUsage,
                           {.what = fmt::format("{}: no key '{}'", place(table_), key),
                            .expected = std::string(expected)});
    }
    const auto found = reader(*node);
    if (!found) refuse(*node, key, expected);
    value = *found;
  }

  void number_of(std::string_view key, double& value, bool may_miss = true) const {
    read(key, kNumber, number, value, may_miss);
  }
  void triple_of(std::string_view key, glm::dvec3& value, bool may_miss = true) const {
    read(key, kTriple, triple, value, may_miss);
  }

  [[noreturn]] void refuse(const toml::node& node, std::string_view key,
                           std::string_view expected) const {
    throw formats::Error(formats::ErrorKind::kUsage,
                         {.what = fmt::format("{}: {}", place(node), key),
                          .found = formats::described(node),
                          .expected = std::string(expected)});
  }
  /// Says what is wrong with the table as a whole.
  [[noreturn]] void refuse(std::string_view what) const {
    formats::throw_usage(fmt::format("{}: {}", place(table_), what));
  }

 private:
  std::string place(const toml::node& node) const {
    return fmt::format("{}, line {}{}{}", file_.string(), node.source().begin.line,
                       owner_.empty() ? "" : ": ", owner_);
  }

  const toml::table& table_;
  const std::filesystem::path& file_;
  std::string owner_;
};

/// A camera whose time is after that of the one before, if there is one.
TimedCamera read_camera(const toml::table& table, const std::filesystem::path& file,
                        const std::vector<TimedCamera>& before) {
  const WalkTable keys(table, file, fmt::format("camera {}", before.size() + 1),
                       {"time", "eye", "target", "up", "fov"});
  TimedCamera key;
  keys.number_of("time", key.time_s, false);
  keys.triple_of("eye", key.camera.eye, false);
  keys.triple_of("target", key.camera.target, false);
  keys.triple_of("up", key.camera.up);
  keys.number_of("fov", key.camera.fov_y_degrees);
  if (before.empty() ? !(key.time_s >= 0) : !(key.time_s > before.back().time_s))
    keys.refuse(*keys.find("time"), "time",
                before.empty() ? "at least 0"
                               : fmt::format("a time after {}, that of the camera before",
                                             before.back().time_s));
  if (const std::string fault = fault_of(key.camera); !fault.empty()) keys.refuse(fault);
  return key;
}

std::vector<TimedCamera> read_cameras(const WalkTable& root, const toml::node& node,
                                      const std::filesystem::path& file) {
  constexpr std::string_view kTables = "tables [[camera]]";
  const toml::array* items = node.as_array();
  if (items == nullptr || items->empty()) root.refuse(node, "camera", kTables);
  std::vector<TimedCamera> keyframes;
  keyframes.reserve(items->size());
  for (const toml::node& item : *items) {
    if (!item.is_table()) root.refuse(item, "camera", kTables);
    keyframes.push_back(read_camera(*item.as_table(), file, keyframes));
  }
  return keyframes;
}

Walk read_orbit(const toml::table& table, const std::filesystem::path& file,
                double frames_per_second) {
  const WalkTable keys(table, file, "orbit",
                       {"center", "radius", "seconds", "height", "turns", "start", "fov"});
  Orbit orbit;
  keys.triple_of("center", orbit.center, false);
  keys.number_of("radius", orbit.radius, false);
  keys.number_of("seconds", orbit.seconds, false);
  keys.number_of("height", orbit.height);
  keys.number_of("turns", orbit.turns);
  keys.number_of("start", orbit.start_degrees);
  keys.number_of("fov", orbit.fov_y_degrees);
  try {
    return orbit_walk(orbit, frames_per_second);
  } catch (const formats::Error& error) {
    keys.refuse(error.what());
  }
}

}  // namespace

Walk parse_walk(std::string_view text, const std::filesystem::path& file) {
  const toml::table table = formats::parse_toml(text, file.string());
  const WalkTable root(table, file, "", {"frames_per_second", "camera", "orbit"});
  double frames_per_second = 30;
  const auto rate = [](const toml::node& node) {
    const auto value = number(node);
    return value && *value > 0 && *value <= Walk::kMostFramesPerSecond ? value : std::nullopt;
  };
  root.read("frames_per_second", "a number above 0, at most 1000", rate, frames_per_second, true);
  const toml::node* cameras = root.find("camera");
  const toml::node* orbit = root.find("orbit");
  if ((cameras == nullptr) == (orbit == nullptr))
    root.refuse("expected tables [[camera]] or one table [orbit], not both");
  if (orbit != nullptr) {
    if (!orbit->is_table()) root.refuse(*orbit, "orbit", "a table [orbit]");
    return read_orbit(*orbit->as_table(), file, frames_per_second);
  }
  std::vector<TimedCamera> keyframes = read_cameras(root, *cameras, file);
  try {
    return Walk(std::move(keyframes), frames_per_second);
  } catch (const formats::Error& error) {
    root.refuse(error.what());
  }
}

Walk read_walk(const std::filesystem::path& file) {
  return parse_walk(formats::read_toml_text(file), file);
}

std::string walk_text(const Walk& walk) {
  const auto triple_text = [](const glm::dvec3& v) {
    return fmt::format("[{}, {}, {}]", number_text(v.x), number_text(v.y), number_text(v.z));
  };
  std::string text = fmt::format("frames_per_second = {}\n", number_text(walk.frames_per_second()));
  for (const auto& [time_s, camera] : walk.keyframes())
    text += fmt::format("\n[[camera]]\ntime = {}\neye = {}\ntarget = {}\nup = {}\nfov = {}\n",
                        number_text(time_s), triple_text(camera.eye), triple_text(camera.target),
                        triple_text(camera.up), number_text(camera.fov_y_degrees));
  return text;
}

void write_walk(const Walk& walk, const std::filesystem::path& file) {
  const std::string text = walk_text(walk);
  formats::PartFile part(file, true);
  part.file().append(std::as_bytes(std::span(text)));
  part.publish();
}

}  // namespace cairn::viewer
