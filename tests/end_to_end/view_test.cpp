// The window on a screen in memory, with mouse and keyboard as a person has them.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <thread>

#include "tests/end_to_end/below_root.h"
#include "tests/end_to_end/program_test.h"
#include "tests/support/pictures.h"
#include "tests/support/tiny_dataset.h"
#include "tests/support/tiny_scans.h"
#include "tests/support/virtual_screen.h"
#include "viewer/picture.h"
#include "viewer/walk_file.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using Json = nlohmann::json;

constexpr int kPoints = 5000;
/// Where the budget's slider lies in the window: pixels from its left and upper edge.
constexpr int kSliderRight = 230, kSliderLeft = 14, kSliderY = 47;

class View : public ProgramTest {
 protected:
  void SetUp() override {
    if (!VirtualScreen::available()) {
      if (std::getenv("CAIRN_SHARED_DATA_REQUIRED") != nullptr) FAIL() << "no Xvfb or xdotool";
      GTEST_SKIP() << "no Xvfb or xdotool on this machine";
    }
    ASSERT_EQ(build({write_wavy_las(folder_ / "a.las", kPoints), "--node-points", "300"}).exit_code,
              0);
    fs::create_directory(pictures());
    pass_over_leaks_of_the_driver();
    screen_.emplace();
  }
  void TearDown() override { ::unsetenv("LSAN_OPTIONS"); }

  /// Mesa's driver is unloaded with two blocks (112 bytes) that it still points to, so that the leak
  /// sanitizer sees no owner and, with no module left, no name that could be suppressed. While the
  /// driver stays loaded, there is no leak. All other checks stay on.
  static void pass_over_leaks_of_the_driver() {
#if defined(__has_feature)
#if __has_feature(address_sanitizer)
    ::setenv("LSAN_OPTIONS", "detect_leaks=0", 1);
#endif
#endif
  }

  fs::path pictures() const { return folder_ / "pictures"; }
  std::string picture(int number) const {
    return pictures() / fmt::format("cairn-{:04}.png", number);
  }

  std::vector<std::string> arguments(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{"view",    dataset_, "--size",        "640x400",
                                 "--stats", "json",   "--screenshots", pictures()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  /// Waits until `done`, and fails if the program ends before or nothing comes of it.
  template <typename Done>
  void wait_until(const Done& done) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(3);
    while (!done()) {
      if (!view_->running()) throw std::runtime_error("the window closed: " + view_->err());
      if (std::chrono::steady_clock::now() > deadline) throw std::runtime_error("waited too long");
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  /// Opens the window and lays the mouse into it, beside the panels.
  void open(const std::vector<std::string>& more = {}) {
    view_.emplace(CAIRN_PROGRAM, arguments(more));
    wait_until([&] {
      return run_program("/usr/bin/env", {"xdotool", "search", "--onlyvisible", "--class", "cairn"})
                 .exit_code == 0;
    });
    window_ = screen_->xdotool({"search", "--onlyvisible", "--class", "cairn"});
    window_ = window_.substr(0, window_.find('\n'));
    move_to(320, 350);
    // The first key may be lost, as long as the window has not come up.
    int polls = 0;
    wait_until([&] {
      if (polls++ % 100 == 0) key("F12");
      return fs::exists(picture(pictures_taken_ + 1));
    });
    if (polls > 100)
      std::this_thread::sleep_for(std::chrono::seconds(5));  // for those of other keys
    while (fs::exists(picture(pictures_taken_ + 1))) ++pictures_taken_;
  }

  void move_to(int x, int y) {
    screen_->xdotool({"mousemove", "--window", window_, std::to_string(x), std::to_string(y)});
  }
  void key(const std::string& name) { screen_->xdotool({"key", name}); }

  /// Takes a screenshot, which tells that a frame was drawn with all that was done before.
  void after_a_frame() {
    const std::string next = picture(++pictures_taken_);
    key("F12");
    wait_until([&] { return fs::exists(next); });
  }

  void drag(std::pair<int, int> from, std::pair<int, int> to) {
    move_to(from.first, from.second);
    after_a_frame();
    screen_->xdotool({"mousedown", "1"});
    after_a_frame();
    move_to(to.first, to.second);
    after_a_frame();
    screen_->xdotool({"mouseup", "1"});
    after_a_frame();
  }

  /// Opens the window and waits until it shows what `render` draws of the folder.
  void expect_drawn_picture(const std::vector<std::string>& more = {}) {
    const std::string drawn = folder_ / "drawn.png";
    ASSERT_EQ(cairn({"render", output(), "-o", drawn, "--size", "640x400"}).exit_code, 0);
    const viewer::Picture expected = viewer::read_png(drawn);
    ASSERT_GT(share_of_pixels_apart(
                  expected,
                  {expected.size, std::vector<std::uint8_t>(expected.rgb.size(), expected.rgb[0])}),
              0.01);
    open(more);
    wait_until([&] {  // nodes are read meanwhile
      after_a_frame();
      return share_of_pixels_apart(viewer::read_png(picture(pictures_taken_)), expected) <= 0.01;
    });
  }

  /// Closes the window and returns what it told on stdout.
  Json close() {
    key("Escape");
    const Outcome outcome = view_->wait();
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return Json::parse(outcome.out, nullptr, false);
  }

  std::string dataset_ = output();  ///< that is shown
  std::optional<VirtualScreen> screen_;
  std::optional<RunningProgram> view_;
  std::string window_;
  int pictures_taken_ = 0;
};

TEST_F(View, ShowsTheDatasetAsRenderDrawsIt) {
  expect_drawn_picture();
  const Json told = close();
  EXPECT_EQ(told["points"], kPoints);
  EXPECT_EQ(told["mode"], "gl");
  EXPECT_EQ(told["size"], Json::array({640, 400}));
  EXPECT_EQ(told["sections"], Json::array({"position", "radius"}));
}

TEST_F(View, ShowsADatasetOnAServerAlike) {
  const WebServer server(folder_.path());
  dataset_ = server.url("site.cairn");
  expect_drawn_picture({"--web-cache", "off"});
  EXPECT_EQ(close()["points"], kPoints);
}

TEST_F(View, TheBudgetSliderChangesThePointsDrawn) {
  const Json levels = info()["levels"];
  open({"--budget", std::to_string(kPoints)});
  drag({kSliderRight, kSliderY}, {kSliderLeft, kSliderY});
  // The camera sees all of the scene, and the least budget is that of the root.
  EXPECT_EQ(close()["points"], levels[0]["points"]);
}

TEST_F(View, TheBudgetFollowsTheKeys) {
  open({"--budget", std::to_string(kPoints)});
  key("bracketleft");
  after_a_frame();
  const int points = close()["points"].get<int>();
  EXPECT_LE(points, kPoints / 2);
  EXPECT_GT(points, 300);
}

TEST_F(View, RecordsAWalkAndPlaysIt) {
  const fs::path walk = pictures() / "walk-0001.toml";
  open();
  key("r");
  after_a_frame();
  drag({320, 350}, {380, 350});
  key("r");
  wait_until([&] { return fs::exists(walk); });
  const Json told = close();
  const auto keyframes = viewer::read_walk(walk).keyframes();
  ASSERT_GE(keyframes.size(), 2U);
  const viewer::Camera &first = keyframes.front().camera, &last = keyframes.back().camera;
  EXPECT_EQ(first.target, last.target);
  EXPECT_NE(first.eye, last.eye);
  EXPECT_NEAR(told["camera"]["eye"][0].get<double>(), last.eye.x, 1e-9 * std::abs(last.eye.x));

  view_.emplace(CAIRN_PROGRAM, arguments({"--path", walk.string(), "--frames", "3"}));
  const Outcome outcome = view_->wait();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(Json::parse(outcome.out)["frames"], 3);
}

TEST_F(View, ADamagedNodeIsToldOnceAndStoodInFor) {
  const fs::path nodes = fs::path(output()) / "nodes.bin";
  auto bytes = read_file(nodes);
  const auto dataset = formats::DatasetReader::open(output());
  const formats::NodeRecord& last_leaf = dataset.nodes().back();
  bytes[last_leaf.sections[formats::kPositionSection].offset] ^= std::byte{1};
  write_file(nodes, bytes);
  open();
  wait_until([&] { return view_->err().find("warning") != std::string::npos; });
  after_a_frame();
  const Json told = close();
  EXPECT_EQ(told["damaged"], 1);
  EXPECT_LT(told["points"], kPoints);
  std::vector<std::string> lines = lines_of(view_->err());
  ASSERT_EQ(lines.size(), 1U) << view_->err();
  EXPECT_THAT(lines[0], AllOf(HasSubstr("nodes.bin"), HasSubstr("drawn by what stands for it")));
}

/// A frame takes milliseconds: the rest of these four seconds is for waiting.
TEST_F(View, DrawsNothingWhileAServerIsWaitedFor) {
  WebServer server(folder_.path());
  std::atomic<bool> stalls = false;
  server.set_script(
      [&, waits = asks_below_root(output())](const WebRequest& request) -> std::optional<WebFault> {
        if (!waits(request)) return std::nullopt;
        stalls = true;
        return WebFault{.kind = WebFault::kStall};
      });
  dataset_ = server.url("site.cairn");
  open({"--web-cache", "off"});
  wait_until([&] { return stalls.load(); });
  std::this_thread::sleep_for(std::chrono::seconds(4));
  const Json told = close();
  EXPECT_LT(told["points"], kPoints);
  EXPECT_LT(told["frames"], 30);
}

TEST_F(View, ASignalClosesIt) {
  open();
  view_->signal(SIGTERM);
  const Outcome outcome = view_->wait();
  EXPECT_EQ(outcome.exit_code, 128 + SIGTERM);
  EXPECT_EQ(outcome.out, "");
}

TEST_F(View, WithoutADisplayOneLineNamesWhatNeedsNone) {
  screen_.reset();
  const Outcome outcome = cairn({"view", output()});
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("DISPLAY"), HasSubstr("--mode cpu")));
}

}  // namespace
}  // namespace cairn::test
