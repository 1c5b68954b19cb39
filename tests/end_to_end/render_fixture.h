// What tests of `cairn render` share: a dataset, pictures of it, and refusals.
#pragma once

#include <algorithm>
#include <set>

#include "tests/end_to_end/program_test.h"
#include "tests/support/tiny_dataset.h"
#include "tests/support/tiny_scans.h"
#include "viewer/picture.h"

namespace cairn::test {

inline constexpr int kPoints = 5000;
/// Two seconds around the scan of write_wavy_las at ten frames a second, both ends included.
inline constexpr const char* kWalk =
    "frames_per_second = 10\n[orbit]\ncenter = [500, 500, 0]\nradius = 1500\nseconds = 2\n"
    "height = 800\n";
inline constexpr std::size_t kWalkFrames = 21;

/// A dataset without normals and colors: site.cairn.
class Render : public ProgramTest {
 protected:
  void SetUp() override {
    const Outcome built =
        build({write_wavy_las(folder_ / "a.las", kPoints), "--node-points", "300"});
    ASSERT_EQ(built.exit_code, 0) << built.err;
  }

  std::string file(const std::string& name) const { return folder_ / name; }

  std::vector<std::string> arguments(const std::string& to, const std::vector<std::string>& more) {
    std::vector<std::string> all{"render", output(), "-o", file(to), "--stats", "json"};
    if (std::ranges::find(more, "--size") == more.end())
      all.insert(all.end(), {"--size", "320x200"});
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  /// What `cairn render` tells of a picture or walk that it draws without complaint.
  nlohmann::json render(const std::string& to, const std::vector<std::string>& more = {}) {
    const Outcome outcome = cairn(arguments(to, more));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }

  viewer::Picture picture(const std::string& name) const { return viewer::read_png(file(name)); }

  std::set<std::filesystem::path> entries() const {
    std::set<std::filesystem::path> paths;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path()))
      paths.insert(entry.path());
    return paths;
  }

  /// One line that holds `text`, and no file that was not there before.
  void expect_refused(const std::vector<std::string>& arguments, int exit_code,
                      const std::string& text) {
    SCOPED_TRACE(testing::PrintToString(arguments));
    const std::set<std::filesystem::path> before = entries();
    const Outcome outcome = cairn(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const auto lines = lines_of(outcome.err);
    ASSERT_EQ(lines.size(), 1U) << outcome.err;
    EXPECT_THAT(lines.front(), ::testing::AllOf(::testing::StartsWith("cairn: error: "),
                                                ::testing::HasSubstr(text)));
    EXPECT_EQ(entries(), before);
  }

  /// Flips a bit in the middle of a file.
  void damage(const std::filesystem::path& path) {
    auto bytes = read_file(path);
    bytes[bytes.size() / 2] ^= std::byte{1};
    write_file(path, bytes);
  }

  /// Flips a bit in the positions of a node, which the index then tells otherwise.
  void damage_positions(std::size_t node) {
    const std::filesystem::path path = std::filesystem::path(output()) / "nodes.bin";
    auto bytes = read_file(path);
    const auto dataset = formats::DatasetReader::open(output());
    bytes[dataset.nodes().at(node).sections[formats::kPositionSection].offset] ^= std::byte{1};
    write_file(path, bytes);
  }

  std::size_t last_node() const {
    return formats::DatasetReader::open(output()).nodes().size() - 1;
  }
};

inline bool is_one_color(const viewer::Picture& picture) {
  for (std::size_t i = 3; i < picture.rgb.size(); ++i)
    if (picture.rgb[i] != picture.rgb[i - 3]) return false;
  return true;
}

}  // namespace cairn::test
