// Which setting of a study is recommended, against a search of all of them.
#include "pipeline/study/recommend.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "formats/error.h"
#include "pipeline/config.h"
#include "tests/support/temporary_folder.h"

namespace cairn::pipeline {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Results without levels: metrics[input][setting] are the rms and the seconds a million points.
StudyResults results_of(const std::vector<std::vector<std::pair<double, double>>>& metrics) {
  StudyResults results{.name = "s", .repetitions = 3, .threads = 2};
  for (std::size_t s = 0; s < metrics.front().size(); ++s) {
    StudySetting setting{"theta " + std::to_string(s), {}, {"theta"}};
    setting.values["theta"] = {{std::to_string(s)}, "sweep"};
    results.settings.push_back(setting);
  }
  for (std::size_t i = 0; i < metrics.size(); ++i) {
    results.inputs.push_back({"input" + std::to_string(i), 1e6});
    for (std::size_t s = 0; s < metrics[i].size(); ++s) {
      const auto [rms, seconds] = metrics[i][s];
      results.results.push_back({.input = i,
                                 .setting = s,
                                 .metrics = {{"rms", rms, rms, rms},
                                             {"build_s_per_M", seconds, seconds, seconds, true}}});
    }
  }
  return results;
}

std::vector<std::size_t> order_of(const std::vector<Candidate>& ranked) {
  std::vector<std::size_t> settings;
  for (const Candidate& candidate : ranked) settings.push_back(candidate.setting);
  return settings;
}

TEST(Recommend, WhatIsNotKnownOrTheSameForAllDecidesNothing) {
  // The first input is drawn from its leaves: all have the error 0 there.
  StudyResults results = results_of({{{0, 1}, {0, 1}, {0, 1}}, {{5, 1}, {3, 1}, {4, 1}}});
  const Condition pace = parse_within("60s/1M");
  EXPECT_THAT(order_of(rank_settings(results, {pace}, "rms")), ElementsAre(1, 2, 0));
  // Of a tree of one level no error is known.
  for (StudyResult& result : results.results)
    if (result.input == 0) result.metrics.erase(result.metrics.begin());
  for (const Candidate& candidate : rank_settings(results, {pace}, "rms"))
    EXPECT_FALSE(candidate.meets);
}

TEST(Recommend, AnErrorOfZeroOnOneInputIsBetterThanAnyOther) {
  // Setting 1 is drawn from its leaves on the first input; on the second it is a little better, too.
  const StudyResults results = results_of({{{0.01, 1}, {0, 1}}, {{0.5, 1}, {0.48, 1}}});
  const std::vector<Condition> conditions{parse_within("60s/1M")};
  const auto ranked = rank_settings(results, conditions, "rms");
  EXPECT_THAT(order_of(ranked), ElementsAre(1, 0));
  EXPECT_NEAR(ranked[0].cost, std::sqrt(1e-5 * 0.48), 1e-12);
  EXPECT_THAT(
      recommendation_toml(results, conditions, "rms", ranked),
      HasSubstr("the geometric mean over the inputs where it is above 0 with some setting."));
}

TEST(Recommend, WhatIsNotKnownIsToldAsSuch) {
  // The second input has a tree of one level with every setting; both settings are within the time.
  StudyResults results = results_of({{{5, 0.3}, {3, 0.2}}, {{1, 0.3}, {1, 0.2}}});
  for (StudyResult& result : results.results)
    if (result.input == 1) result.metrics.erase(result.metrics.begin());
  const std::vector<Condition> conditions{parse_within("60s/1M")};
  EXPECT_EQ(
      nothing_found(results, conditions, "rms", rank_settings(results, conditions, "rms")),
      "nothing can be recommended, since with every setting rms is not known of some input: rms "
      "not known on input1");
  // A setting that just misses the time is nearer than one of which nothing is known.
  results.results[1].metrics[1].median = 61;
  results.results[3].metrics.insert(results.results[3].metrics.begin(), {"rms", 1, 1, 1});
  const auto ranked = rank_settings(results, conditions, "rms");
  EXPECT_THAT(order_of(ranked), ElementsAre(1, 0));
  EXPECT_THAT(nothing_found(results, conditions, "rms", ranked),
              HasSubstr("nearest is 'theta 1', with build_s_per_M 61 on input0"));
}

TEST(Recommend, FindsWhatASearchOfAllSettingsFinds) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(1, 100);
  int found = 0;
  for (int round = 0; round < 300; ++round) {
    std::vector<std::vector<std::pair<double, double>>> metrics(3);
    for (auto& input : metrics)
      for (int s = 0; s < 6; ++s) input.emplace_back(any(random), any(random));
    const double limit = any(random);
    const auto ranked = rank_settings(
        results_of(metrics), {{.text = "", .metric = "rms", .limit = limit}}, "build_s_per_M");
    ASSERT_EQ(ranked.size(), 6U);
    double least = INFINITY;
    std::size_t best = 6;
    for (std::size_t s = 0; s < 6; ++s) {
      const bool meets = metrics[0][s].first <= limit && metrics[1][s].first <= limit &&
                         metrics[2][s].first <= limit;
      const double product = metrics[0][s].second * metrics[1][s].second * metrics[2][s].second;
      if (!meets || product >= least) continue;
      least = product;
      best = s;
    }
    EXPECT_EQ(ranked.front().meets, best < 6);
    if (best == 6) continue;
    ++found;
    EXPECT_EQ(ranked.front().setting, best);
    EXPECT_NEAR(ranked.front().cost, std::cbrt(least), 1e-9 * least);
  }
  EXPECT_GT(found, 100);
  EXPECT_LT(found, 290);
}

TEST(Recommend, WithoutOneThatMeetsTheNearestComesFirst) {
  // Setting 0 is best on the first input but far off on the second; 1 misses both by little; 2 has failed.
  StudyResults results = results_of({{{1, 1}, {2.2, 1}, {1, 1}}, {{9, 1}, {2.4, 1}, {1, 1}}});
  results.results[5].failure = "disk full";
  const std::vector<Condition> conditions = parse_conditions("rms <= 2");
  const auto ranked = rank_settings(results, conditions, "build_s_per_M");
  EXPECT_THAT(order_of(ranked), ElementsAre(1, 0, 2));
  EXPECT_FALSE(ranked.front().meets);
  EXPECT_NEAR(ranked.front().excess, 1.2, 1e-12);
  EXPECT_EQ(
      nothing_found(results, conditions, "build_s_per_M", ranked),
      "no setting meets 'rms <= 2' on all inputs; nearest is 'theta 1', with rms 2.4 on input1");
}

TEST(Recommend, WithinATimeTheMostAccurateIsChosen) {
  const StudyResults results =
      results_of({{{1, 0.7}, {2, 0.5}, {3, 0.1}}, {{1, 0.1}, {2, 0.6}, {3, 0.1}}});
  // 60 s for 100 M points are 0.6 s for a million.
  EXPECT_THAT(order_of(rank_settings(results, {parse_within("60s/100M")}, "rms")),
              ElementsAre(1, 2, 0));
  EXPECT_EQ(parse_within("500ms/200k").limit, 2.5);
  EXPECT_EQ(parse_within("5min/1000M").limit, 0.3);
  for (const char* wrong :
       {"", "60s", "60/100M", "60s/100", "60m/100M", "s/1M", "0s/1M", "60s/10%"})
    EXPECT_THROW(parse_within(wrong), formats::Error) << wrong;
}

TEST(Recommend, ConditionsHaveUnits) {
  const auto all =
      parse_conditions("rms@10% <= 2mm and build_s<5min; frame_ms@1M <= 1s, psnr@1M >= 40 dB");
  ASSERT_EQ(all.size(), 4U);
  EXPECT_EQ(all[0].metric, "rms@10%");
  EXPECT_EQ(all[0].limit, 0.002);
  EXPECT_TRUE(all[0].holds(0.002));
  EXPECT_EQ(all[1].limit, 300);
  EXPECT_FALSE(all[1].holds(300));
  EXPECT_EQ(all[2].limit, 1000);
  EXPECT_TRUE(all[3].at_least);
  EXPECT_TRUE(all[3].holds(40));
  EXPECT_EQ(all[3].excess(20), 2);
  EXPECT_EQ(parse_conditions("uncovered@10% <= 0.5%").front().limit, 0.005);
  for (const char* wrong : {"", "rms", "rms <= ", "rms <= x", "rms <= 2kg", "rms <= 2s",
                            "rms <= 2%", "rms = 2", "<= 2", "rms >= 2", "psnr@1M < 40", "rms <= 0",
                            "rms <= -1", "rms <= 1,", "rms <= inf", "rms <= 2mm 3"})
    EXPECT_THROW(parse_conditions(wrong), formats::Error) << wrong;
}

TEST(Recommend, AnUnknownMetricIsNamedBesideThoseThatAreKnown) {
  try {
    require_known(parse_conditions("warmth < 3"), results_of({{{1, 1}}}));
    FAIL();
  } catch (const formats::Error& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr("no result has 'warmth'"), HasSubstr("rms, build_s_per_M")));
  }
}

TEST(Recommend, TheFileIsAConfigurationThatTellsWhy) {
  StudyResults results = results_of({{{1, 2}, {2, 1}}, {{1.5, 2}, {3, 1}}});
  results.settings[0].values["reducer"] = {{"random"}, "sweep"};
  results.settings[0].values["fanout"] = {{"auto"}, "sweep"};
  results.settings[0].values["estimate"] = {{"normals", "radii"}, "sweep"};
  const auto conditions = parse_conditions("rms <= 2");
  const std::string text = recommendation_toml(results, conditions, "build_s_per_M",
                                               rank_settings(results, conditions, "build_s_per_M"));
  for (const char* part :
       {"rms at 1 level above the leaves", "input1                      1.5   75 % of", "theta 1 ",
        "no: rms 3 on input1"})
    EXPECT_THAT(text, HasSubstr(part));
  const SettingLayer read = parse_config(text, "recommended.toml", {});
  ASSERT_EQ(read.size(), 4U);
  for (const auto& [key, given] : read)
    EXPECT_EQ(given.values, results.settings[0].values.at(key).values) << key;
  EXPECT_EQ(resolve_campaign(read, std::nullopt).scans.size(), 0U);
}

TEST(ErrorCurve, BetweenTwoLevelsIsTheMeanOverTheNodesThatAreRefined) {
  // Ten nodes of 6 points with rms 3, each of which may be refined to 25 points with rms 1.
  const ErrorCurve curve{.leaf_points = 1000,
                         .levels = {{250, {1, 2, 5, 1, 0.2, 2}}, {60, {3, 4, 9, 3, 0.5, 4}}}};
  for (int refined = 0; refined <= 10; ++refined) {
    const ErrorPlace cut{ErrorPlace::Unit::kPoints, 6.0 * (10 - refined) + 25.0 * refined};
    const double mean_square = (9.0 * (10 - refined) + 1.0 * refined) / 10;
    EXPECT_NEAR(*error_at(curve, "rms", cut), std::sqrt(mean_square), 1e-12);
    EXPECT_EQ(*error_at(curve, "largest", cut), refined == 10 ? 5 : 9);
    EXPECT_NEAR(*error_at(curve, "nearest_rms", cut), std::sqrt(mean_square), 1e-12);
    EXPECT_NEAR(*error_at(curve, "uncovered", cut), (0.5 * (10 - refined) + 0.2 * refined) / 10,
                1e-12);
    EXPECT_NEAR(*error_at(curve, "overdraw", cut), (4.0 * (10 - refined) + 2.0 * refined) / 10,
                1e-12);
  }
  using enum ErrorPlace::Unit;
  // Points 0, 0, 0, 10 are up to 7.5 from their mean, 0, 0, 0, 10, 10, 10 up to 5 from theirs: refined may be worse.
  const ErrorCurve finer{.leaf_points = 1000,
                         .levels = {{250, {1, 2, 7.5, 1, 0.2, 2}}, {60, {3, 4, 5, 3, 0.5, 4}}}};
  EXPECT_EQ(error_at(finer, "largest", {kPoints, 100}), 7.5);
  EXPECT_EQ(error_at(finer, "largest", {kPoints, 60}), 5);
  EXPECT_EQ(error_at(finer, "percentile_99", {kPoints, 100}), 4);
  EXPECT_EQ(error_at(curve, "rms", {kLevelsAboveLeaves, 2}), 3);
  EXPECT_EQ(error_at(curve, "rms", {kLevelsAboveLeaves, 3}), std::nullopt);
  EXPECT_EQ(error_at(curve, "percentile_99", {kShare, 0.25}), 2);
  EXPECT_EQ(error_at(curve, "rms", {kShare, 1}), 0);
  EXPECT_EQ(error_at(curve, "rms", {kPoints, 5000}), 0);
  EXPECT_EQ(error_at(curve, "rms", {kPoints, 59}), std::nullopt);
  EXPECT_EQ(error_at(curve, "warmth", {kPoints, 60}), std::nullopt);
}

TEST(ErrorCurve, WhatWasNotMeasuredIsNotTold) {
  using enum ErrorPlace::Unit;
  const ErrorCurve curve{.leaf_points = 1000, .levels = {{250, {1, NAN, 5, NAN, 0.2, 2}}}};
  EXPECT_EQ(error_at(curve, "percentile_99", {kShare, 0.25}), std::nullopt);
  EXPECT_EQ(error_at(curve, "nearest_rms", {kShare, 0.5}), std::nullopt);
  EXPECT_EQ(error_at(curve, "largest", {kShare, 0.25}), 5);
  // All leaf points lie in their own splats, so none is uncovered; in how many others is not known.
  EXPECT_NEAR(*error_at(curve, "uncovered", {kShare, 0.625}), 0.1, 1e-12);
  EXPECT_EQ(error_at(curve, "overdraw", {kShare, 0.25}), 2);
  EXPECT_EQ(error_at(curve, "overdraw", {kShare, 0.625}), std::nullopt);
  EXPECT_EQ(error_at(curve, "overdraw", {kShare, 1}), std::nullopt);
}

TEST(ErrorCurve, WithoutASearchThereIsNothingThatTakesOne) {
  stages::ErrorReport report{.leaf_points = 100};
  report.levels = {{.level = 0, .points = 10, .rms = 2, .largest = 3}};
  ErrorCurve curve = error_curve(report);
  EXPECT_EQ(error_at(curve, "rms", {}), 2);
  EXPECT_EQ(error_at(curve, "uncovered", {}), std::nullopt);
  report.levels[0].geometry.surface = {.nearest = {.rms = 1}, .uncovered = 0.25, .overdraw = 4};
  curve = error_curve(report);
  EXPECT_EQ(error_at(curve, "nearest_rms", {}), 1);
  EXPECT_EQ(error_at(curve, "uncovered", {}), 0.25);
  EXPECT_EQ(error_at(curve, "overdraw", {}), 4);
}

}  // namespace
}  // namespace cairn::pipeline
