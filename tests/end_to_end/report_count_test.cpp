// The report against a count made outside of the program, by a second parser of the index.

#include "tests/end_to_end/program_test.h"
#include "tests/support/manifest.h"
#include "tests/support/shared_data.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

using Json = nlohmann::json;

class ReportCount : public ProgramTest {
 protected:
  Json report() { return Json::parse(cairn({"report", output(), "--json"}).out); }
  Json count() {
    const Outcome counted = run_program(
        "/usr/bin/env", {"python3", CAIRN_SOURCE "/tests/support/count_nodes.py", output()});
    EXPECT_EQ(counted.exit_code, 0) << counted.err;
    return Json::parse(counted.out);
  }

  static void expect_as_counted(const Json& level, const Json& counted, double input_points) {
    EXPECT_EQ(level.at("nodes"), counted.at("nodes"));
    EXPECT_EQ(level.at("points"), counted.at("points"));
    const Json& sizes = level.at("node_points");
    EXPECT_EQ(sizes.at("min"), counted.at("min"));
    EXPECT_EQ(sizes.at("max"), counted.at("max"));
    EXPECT_DOUBLE_EQ(sizes.at("mean").get<double>(), counted.at("mean").get<double>());
    EXPECT_NEAR(sizes.at("variation").get<double>(), counted.at("variation").get<double>(), 1e-12);
    Json histogram = Json::array();
    for (const Json& size : counted.at("sizes"))
      histogram.push_back({{"min", size[0]}, {"max", size[0]}, {"nodes", size[1]}});
    EXPECT_EQ(sizes.at("histogram"), histogram);
    for (const char* spread : {"theta", "grid", "node_rms", "node_bound"})
      EXPECT_EQ(level.at(spread), counted.at(spread)) << spread;
    EXPECT_EQ(level.at("section_bytes"), counted.at("section_bytes"));
    // Every level stands for all input points.
    EXPECT_EQ(counted.at("weight").get<double>(), input_points);
    EXPECT_LE(level.at("rms"), counted.at("node_rms").at("max"));
    EXPECT_GE(level.at("rms"), counted.at("node_rms").at("min"));
  }

  void expect_report_as_counted(std::uint64_t input_points) {
    const Json told = report(), counted = count();
    EXPECT_EQ(told.at("points"), input_points);
    ASSERT_EQ(told.at("levels").size(), counted.size());
    for (std::size_t level = 0; level < counted.size(); ++level) {
      SCOPED_TRACE("level " + std::to_string(level));
      expect_as_counted(told.at("levels")[level], counted[level],
                        static_cast<double>(input_points));
    }
  }
};

TEST_F(ReportCount, TellsWhatTheIndexHolds) {
  // 7001 points divide into leaves of two sizes.
  ASSERT_EQ(build({write_wavy_las(folder_ / "a.las", 7001), "--node-points", "300"}).exit_code, 0);
  expect_report_as_counted(7001);
  EXPECT_EQ(report().at("levels").back().at("node_points").at("histogram").size(), 2U);
}

TEST_F(ReportCount, TellsWhatTheIndexOfARealCampaignHolds) {
  CAIRN_NEEDS_SHARED_DATA();
  ASSERT_EQ(
      build({CAIRN_SOURCE "/configs/campaigns/bunny.toml", "--folder",
             CAIRN_SHARED_DATA "/campaign_bunny", "--node-points", "4000", "--estimate", "normals"})
          .exit_code,
      0);
  std::uint64_t points = 0;
  std::vector<std::uint64_t> claimed;
  for (const ManifestEntry& entry : read_manifest(CAIRN_SHARED_DATA "/MANIFEST.tsv"))
    if (entry.path.starts_with("campaign_bunny/") && entry.points) {
      points += *entry.points;
      claimed.push_back(*entry.points);
    }
  expect_report_as_counted(points);
  const Json sources = report().at("sources");
  ASSERT_EQ(sources.size(), claimed.size());
  for (std::size_t i = 0; i < claimed.size(); ++i) {
    EXPECT_EQ(sources[i].at("claimed"), claimed[i]);
    EXPECT_EQ(sources[i].at("kept"), claimed[i]);
  }
}

}  // namespace
}  // namespace cairn::test
