#include "pipeline/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>
#include <vector>

#include "pipeline/progress_lines.h"
#include "pipeline/stage_clock.h"

namespace cairn::pipeline {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::json;

std::string stderr_of(ProgressMode mode, const std::function<void(stages::ProgressSink&)>& job) {
  ::testing::internal::CaptureStderr();
  {
    const auto progress = make_progress(mode, std::chrono::hours(1));
    job(*progress);
  }
  return ::testing::internal::GetCapturedStderr();
}

void two_stages(stages::ProgressSink& progress) {
  progress.begin("import", 4000);
  std::vector<std::thread> workers;
  for (int i = 0; i < 4; ++i)
    workers.emplace_back([&] {
      for (int k = 0; k < 1000; ++k) progress.advance(1);
    });
  for (std::thread& worker : workers) worker.join();
  progress.end();
  progress.begin("split", 4000);
  progress.advance(1000);
  progress.end();
}

TEST(Progress, JsonLinesParseAndCountEveryPoint) {
  std::istringstream lines(stderr_of(ProgressMode::kJson, two_stages));
  std::vector<Json> events;
  for (std::string line; std::getline(lines, line);) events.push_back(Json::parse(line));
  ASSERT_GE(events.size(), 4U);
  EXPECT_EQ(events.front().at("event"), "begin");
  EXPECT_EQ(events.front().at("stage"), "import");
  EXPECT_EQ(events.front().at("total_points"), 4000);
  EXPECT_EQ(events[1].at("event"), "end");
  EXPECT_EQ(events[1].at("points"), 4000);
  EXPECT_EQ(events[1].at("share"), 1);
  EXPECT_EQ(events.back().at("stage"), "split");
  EXPECT_EQ(events.back().at("points"), 1000);
}

TEST(Progress, ARunningStageIsDrawnAgainAndAgain) {
  for (const ProgressMode mode : {ProgressMode::kBar, ProgressMode::kPlain, ProgressMode::kJson}) {
    ::testing::internal::CaptureStderr();
    {
      const auto progress = make_progress(mode, std::chrono::milliseconds(1));
      progress->begin("cluster", 1000);
      progress->advance(500);
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
    }
    const std::string text = ::testing::internal::GetCapturedStderr();
    const std::string half = mode == ProgressMode::kJson ? "\"share\":0.5" : "50%";
    EXPECT_NE(text.find(half), std::string::npos) << text;
    EXPECT_NE(text.find(half), text.rfind(half)) << text;
  }
}

TEST(Progress, PlainTellsTheEndOfEachStage) {
  const std::string text = stderr_of(ProgressMode::kPlain, two_stages);
  EXPECT_THAT(text, HasSubstr("import: done, 4,000 points in "));
  EXPECT_THAT(text, HasSubstr("split: done, 1,000 points in "));
  EXPECT_EQ(text.back(), '\n');
}

TEST(Progress, BarEndsItsLineEvenIfTheJobEndsInsideAStage) {
  for (const bool drawn : {false, true}) {
    ::testing::internal::CaptureStderr();
    {
      const auto progress = make_progress(
          ProgressMode::kBar, drawn ? std::chrono::milliseconds(1) : std::chrono::hours(1));
      progress->begin("import", 10);
      progress->advance(5);
      if (drawn) std::this_thread::sleep_for(std::chrono::milliseconds(300));
    }
    const std::string text = ::testing::internal::GetCapturedStderr();
    EXPECT_EQ(text.empty(), !drawn);
    EXPECT_TRUE(text.empty() || text.back() == '\n');
  }
}

TEST(Progress, NoneIsSilent) { EXPECT_EQ(stderr_of(ProgressMode::kNone, two_stages), ""); }

TEST(Progress, EndsAtOnceWithoutWaitingForTheNextLine) {
  const auto start = std::chrono::steady_clock::now();
  stderr_of(ProgressMode::kPlain, two_stages);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(4));
}

TEST(ProgressLines, TellShareRateAndTimeLeft) {
  const ProgressState state{.stage = "split", .done = 8400000, .total = 20000000, .elapsed_s = 0.7};
  EXPECT_EQ(plain_line(state),
            "split: 42%, 8,400,000 of 20,000,000 points, 12.0 M points/s, 0:01 left");
  const std::string bar = bar_line(state, 100);
  EXPECT_THAT(bar, HasSubstr("42%"));
  EXPECT_THAT(bar, HasSubstr("12.0 M points/s"));
  EXPECT_THAT(bar, HasSubstr("0:01 left"));
  for (unsigned columns = 1; columns < 200; ++columns)
    EXPECT_LE(bar_line(state, columns).size(), columns);
}

TEST(ProgressLines, AStageWithoutPointsTellsItsTime) {
  ProgressState state{.stage = "open", .elapsed_s = 2};
  EXPECT_EQ(plain_line(state), "open: 2.00 s");
  state.finished = true;
  EXPECT_EQ(plain_line(state), "open: done in 2.00 s");
}

TEST(ProgressLines, SurviveStagesOfNoPointsAndMoreThanClaimed) {
  const ProgressState nothing{.stage = "index"};
  EXPECT_EQ(nothing.share(), 0);
  EXPECT_FALSE(nothing.left_s());
  const ProgressState more{.stage = "index", .done = 30, .total = 20, .elapsed_s = 1};
  EXPECT_EQ(more.share(), 1);
  EXPECT_FALSE(more.left_s());
  EXPECT_TRUE(Json::parse(json_line(nothing, "begin")).at("left_s").is_null());
}

TEST(StageClock, RecordsStagesInOrder) {
  const auto silent = make_progress(ProgressMode::kNone);
  StageClock clock(*silent);
  two_stages(clock);
  ASSERT_EQ(clock.timings().size(), 2U);
  EXPECT_EQ(clock.timings()[0].name, "import");
  EXPECT_EQ(clock.timings()[0].points, 4000U);
  EXPECT_GT(clock.timings()[0].seconds, 0);
  EXPECT_EQ(clock.timings()[1].name, "split");
  EXPECT_EQ(clock.timings()[1].points, 1000U);  // those handled, of 4000 that were announced
}

}  // namespace
}  // namespace cairn::pipeline
