// What keys and mouse mean, and what the window writes and counts, without a window.
#include <GLFW/glfw3.h>
#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "tests/support/temporary_folder.h"
#include "viewer/window/frame_clock.h"
#include "viewer/window/input.h"
#include "viewer/window/numbered_file.h"
#include "viewer/window/panel.h"
#include "viewer/window/walk_recorder.h"

namespace cairn::viewer {
namespace {

constexpr PictureSize kSize{640, 400};

ViewState state_before_origin() {
  ViewState state;
  state.camera.eye = {0, -10, 0};
  state.limits.points = 1000;
  return state;
}

double distance(const Camera& camera) { return glm::distance(camera.eye, camera.target); }

TEST(WindowInput, ADragTurnsAroundTheTargetAndInFlightAboutTheEye) {
  const MouseMove drag{.from = {100, 100}, .to = {140, 100}, .turns = true};
  ViewState orbit = state_before_origin(), flight = orbit;
  flight.fly = true;
  const Camera before = orbit.camera;
  EXPECT_TRUE(steer(orbit, drag, kSize));
  EXPECT_EQ(orbit.camera.target, before.target);
  EXPECT_NEAR(distance(orbit.camera), 10, 1e-9);
  EXPECT_GT(glm::distance(orbit.camera.eye, before.eye), 1);
  EXPECT_TRUE(steer(flight, drag, kSize));
  EXPECT_EQ(flight.camera.eye, before.eye);
  EXPECT_GT(glm::distance(flight.camera.target, before.target), 0.1);
}

TEST(WindowInput, AMouseThatHoldsNoButtonMovesNothing) {
  ViewState state = state_before_origin();
  EXPECT_FALSE(steer(state, {.from = {1, 1}, .to = {90, 50}}, kSize));
  EXPECT_EQ(state.camera, state_before_origin().camera);
}

TEST(WindowInput, ShiftingMovesEyeAndTargetAlike) {
  ViewState state = state_before_origin();
  EXPECT_TRUE(steer(state, {.from = {0, 0}, .to = {30, 20}, .shifts = true}, kSize));
  EXPECT_NEAR(glm::distance(state.camera.eye - state.camera.target, glm::dvec3(0, -10, 0)), 0,
              1e-9);
  EXPECT_LT(state.camera.target.x, 0);  // the scene follows the hand to the right,
  EXPECT_GT(state.camera.target.z, 0);  // and down
}

TEST(WindowInput, TheWheelComesNearerAndInFlightGoesFaster) {
  ViewState orbit = state_before_origin(), flight = orbit;
  flight.fly = true;
  EXPECT_TRUE(steer(orbit, {.wheel = 1}, kSize));
  EXPECT_NEAR(distance(orbit.camera), 10 / 1.2, 1e-9);
  EXPECT_FALSE(steer(flight, {.wheel = 1}, kSize));
  EXPECT_NEAR(flight.fly_speed, 1.2, 1e-12);
  steer(flight, {.wheel = 1e9}, kSize);
  EXPECT_LE(flight.fly_speed, 64);
}

TEST(WindowInput, KeysFlyForTheTimeThatTheyAreHeld) {
  const Box scene{{0, 0, 0}, {1, 1, 1}};
  ViewState once = state_before_origin(), faster = once;
  faster.fly_speed = 2;
  EXPECT_FALSE(fly(once, {0, 0, 0}, 1, scene));
  EXPECT_TRUE(fly(once, {0, 0, 1}, 0.1, scene));
  EXPECT_TRUE(fly(faster, {0, 0, 1}, 0.1, scene));
  const double way = once.camera.eye.y + 10;
  EXPECT_GT(way, 0);
  EXPECT_NEAR(faster.camera.eye.y + 10, 2 * way, 1e-9);
}

TEST(WindowInput, BracketsHalveAndDoubleTheBudgetWithinItsRange) {
  const BudgetRange range{.least = 300, .most = 1500};
  ViewState state = state_before_origin();
  Actions actions;
  const auto points_after = [&](int key) {
    press(state, key, range, actions);
    return state.limits.points;
  };
  EXPECT_EQ(points_after(GLFW_KEY_LEFT_BRACKET), 500U);
  EXPECT_EQ(points_after(GLFW_KEY_LEFT_BRACKET), 300U);
  EXPECT_EQ(points_after(GLFW_KEY_RIGHT_BRACKET), 600U);
  state.limits.points = SelectionLimits::kUnlimited;
  EXPECT_EQ(points_after(GLFW_KEY_RIGHT_BRACKET), 1500U);
  state.limits.points = SelectionLimits::kUnlimited;
  EXPECT_EQ(points_after(GLFW_KEY_LEFT_BRACKET), 750U);
  EXPECT_TRUE(actions.empty());
}

TEST(WindowInput, KeysAskForActionsAndLettersThatFlyForNone) {
  ViewState state = state_before_origin();
  Actions actions;
  for (const int key : {GLFW_KEY_S, GLFW_KEY_F12, GLFW_KEY_R, GLFW_KEY_P, GLFW_KEY_HOME,
                        GLFW_KEY_ESCAPE, GLFW_KEY_Q})
    press(state, key, {}, actions);
  EXPECT_EQ(actions,
            (Actions{Action::kScreenshot, Action::kScreenshot, Action::kRecord, Action::kReplay,
                     Action::kResetCamera, Action::kClose, Action::kClose}));
  actions.clear();
  press(state, GLFW_KEY_SPACE, {}, actions);
  EXPECT_TRUE(state.fly);
  press(state, GLFW_KEY_S, {}, actions);
  EXPECT_TRUE(actions.empty());
  press(state, GLFW_KEY_3, {}, actions);
  EXPECT_EQ(state.wishes.primitive, Primitive::kSplats);
  press(state, GLFW_KEY_0, {}, actions);
  EXPECT_EQ(state.wishes.primitive, std::nullopt);
}

TEST(BudgetRange, ReachesFromTheRootToTheDatasetButNotBeyondWhatIsUseful) {
  const auto range = [](std::uint64_t all, std::uint64_t asked) {
    return budget_range(100, all, asked).most;
  };
  EXPECT_EQ(range(5000, 3'000'000), 3'000'000U);
  EXPECT_EQ(range(5'000'000'000, 3'000'000), 20'000'000U);
  EXPECT_EQ(range(5'000'000'000, 30'000'000), 30'000'000U);
  EXPECT_EQ(range(5'000'000'000, SelectionLimits::kUnlimited), 5'000'000'000U);
  EXPECT_EQ(budget_range(100, 5000, 1).least, 100U);
}

TEST(WalkRecorder, KeepsAKeyframeEveryQuarterSecondAndTheLastCamera) {
  WalkRecorder recorder;
  Camera camera = state_before_origin().camera;
  recorder.note(0, camera);
  EXPECT_FALSE(recorder.recording());
  recorder.start(100, camera);
  for (const double now : {100.1, 100.2, 100.25, 100.3, 100.6}) recorder.note(now, camera);
  camera.eye.x = 5;
  const Walk walk = recorder.finish(100.7, camera);
  EXPECT_FALSE(recorder.recording());
  std::vector<double> times;
  for (const TimedCamera& key : walk.keyframes()) times.push_back(key.time_s);
  ASSERT_EQ(times.size(), 4U);
  EXPECT_NEAR(times[1], 0.25, 1e-9);
  EXPECT_NEAR(times[2], 0.6, 1e-9);
  EXPECT_NEAR(times[3], 0.7, 1e-9);
  EXPECT_EQ(walk.keyframes().back().camera, camera);
}

TEST(NumberedFile, TakesTheFirstNumberThatIsFree) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(next_free_name(folder.path(), "cairn", ".png"), folder / "cairn-0001.png");
  folder.write("cairn-0001.png", "");
  folder.write("cairn-0003.png", "");
  EXPECT_EQ(next_free_name(folder.path(), "cairn", ".png"), folder / "cairn-0002.png");
  std::filesystem::create_symlink("nowhere", folder / "cairn-0002.png");
  EXPECT_EQ(next_free_name(folder.path(), "cairn", ".png"), folder / "cairn-0004.png");
}

TEST(FrameClock, CountsFramesThatFollowOneAnotherAndNoRest) {
  FrameClock clock;
  clock.tick(10, true);
  EXPECT_EQ(clock.frames_per_s(), 0);
  for (int i = 1; i <= 30; ++i) clock.tick(10 + i * 0.1, false);
  EXPECT_NEAR(clock.frames_per_s(), 10, 1e-6);
  clock.tick(500, true);
  EXPECT_NEAR(clock.frames_per_s(), 10, 1e-6);
  EXPECT_EQ(clock.step_s(), 0);
  clock.tick(510, false);
  EXPECT_EQ(clock.step_s(), 0.25);
}

TEST(ShortCount, HasThreeDigitsAndAUnit) {
  EXPECT_EQ(short_count(0), "0");
  EXPECT_EQ(short_count(950), "950");
  EXPECT_EQ(short_count(65'536), "65.5 k");
  EXPECT_EQ(short_count(999'600), "1.00 M");
  EXPECT_EQ(short_count(3'000'000), "3.00 M");
  EXPECT_EQ(short_count(218'020), "218 k");
  EXPECT_EQ(short_count(28e9), "28.0 G");
}

}  // namespace
}  // namespace cairn::viewer
