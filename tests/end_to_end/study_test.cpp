// Studies of small scans: results that other programs read, interrupted ones that go on, and recommendations that
// build.
#include <csignal>
#include <map>
#include <set>
#include <sstream>

#include "tests/end_to_end/program_test.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using Json = nlohmann::json;

class Study : public ProgramTest {
 protected:
  void SetUp() override {
    write_wavy_las(folder_ / "wavy.las", 20000);
    write_wavy_las(folder_ / "small.las", 3000);
  }

  /// Two reducers on two inputs.
  std::string study(const std::string& head = "repetitions = 2\n") {
    return folder_.write("s.toml", head +
                                       "[[input]]\nname = \"wavy\"\nscans = [\"w*.las\"]\n"
                                       "[[input]]\nname = \"small\"\nscans = [\"small.las\"]\n"
                                       "[settings]\nnode_points = 300\nfanout = 3\n"
                                       "[sweep]\nreducer = [\"cluster\", \"first\"]\n");
  }

  Outcome run(const std::string& file, std::vector<std::string> flags = {}) {
    flags.insert(flags.begin(), {"study", "--progress", "none", file, "-o", results()});
    return cairn(std::move(flags));
  }

  std::string results() const { return folder_ / "out"; }
  Json result_file() const { return Json::parse(read_text(fs::path(results()) / "results.json")); }

  /// The files of finished runs.
  std::map<std::string, std::string> runs() const {
    std::map<std::string, std::string> bytes;
    for (const auto& entry : fs::directory_iterator(fs::path(results()) / "runs"))
      if (entry.path().extension() == ".json")
        bytes[entry.path().filename().string()] = read_text(entry.path());
    return bytes;
  }

  /// All that does not depend on time.
  static Json timeless(Json results) {
    for (Json& result : results["results"]) {
      result.erase("builds");
      for (auto metric = result["metrics"].begin(); metric != result["metrics"].end();)
        metric = metric->is_object() ? result["metrics"].erase(metric) : std::next(metric);
    }
    return results;
  }
};

TEST_F(Study, MeasuresWhatMeasureDoes) {
  const Outcome outcome = run(study(), {"--keep"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("## wavy: 20,000 points"), HasSubstr("| first "),
                                 HasSubstr("2 repetitions")));
  EXPECT_EQ(outcome.out, read_text(fs::path(results()) / "table.md"));
  const Json all = result_file()["results"];
  ASSERT_EQ(all.size(), 4U);
  for (const Json& result : all) {
    const std::string name =
        result["input"].get<std::string>() + ", " + result["setting"].get<std::string>() + ".cairn";
    const fs::path dataset = fs::path(results()) / "datasets" / name;
    const Json measured = Json::parse(
        cairn({"measure", "--json", "--progress", "none", dataset.string()}).out)["levels"];
    const Json metrics = result["metrics"];
    EXPECT_EQ(metrics["rms"], measured.back()["rms"]);
    const Json surface = measured.back()["geometry"]["surface"];
    EXPECT_EQ(metrics["nearest_rms"], surface["nearest"]["rms"]);
    EXPECT_EQ(metrics["uncovered"], surface["uncovered"]);
    EXPECT_EQ(metrics["overdraw"], surface["overdraw"]);
    EXPECT_EQ(metrics["points_drawn"], measured.back()["points"]);
    ASSERT_EQ(result["levels"].size(), measured.size());
    EXPECT_EQ(result["levels"].back()["largest"], measured.front()["largest"]);
    std::uintmax_t bytes = 0;
    for (const char* file : {"index.bin", "nodes.bin", "metadata.json"})
      bytes += fs::file_size(dataset / file);
    EXPECT_DOUBLE_EQ(metrics["bytes_per_point"],
                     static_cast<double>(bytes) / (result["input"] == "wavy" ? 20000 : 3000));
    ASSERT_EQ(result["builds"].size(), 2U);
    const double a = result["builds"][0]["elapsed_s"], b = result["builds"][1]["elapsed_s"];
    EXPECT_DOUBLE_EQ(metrics["build_s"]["median"], (a + b) / 2);
    EXPECT_EQ(metrics["build_s"]["min"], std::min(a, b));
  }
  EXPECT_FALSE(fs::exists(fs::path(results()) / "work"));
}

TEST_F(Study, PythonReadsTheSameInCsvAndJson) {
  ASSERT_EQ(run(study()).exit_code, 0);
  const std::string script = folder_.write("compare.py", R"(
import csv, json, sys
rows = list(csv.DictReader(open(sys.argv[1] + "/results.csv", newline="")))
results = json.load(open(sys.argv[1] + "/results.json"))["results"]
assert len(rows) == len(results) == 4
for row, result in zip(rows, results):
    assert (row["input"], row["setting"]) == (result["input"], result["setting"])
    assert row["reducer"] == result["setting"]
    for name, value in result["metrics"].items():
        spread = isinstance(value, dict)
        assert float(row[name]) == (value["median"] if spread else value), name
        if spread:
            assert [float(row[name + end]) for end in ("_min", "_max")] == [value["min"], value["max"]]
    assert None not in row and len(row) > 20
)");
  const Outcome outcome = run_program("/usr/bin/python3", {script, results()});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

TEST_F(Study, AnInterruptedStudyGoesOn) {
  const std::string file = study("repetitions = 3\n");
  ASSERT_EQ(run(file).exit_code, 0);
  const Json undisturbed = timeless(result_file());
  for (const int signal : {SIGINT, SIGKILL}) {
    fs::remove_all(results());
    const Outcome stopped =
        run_program(CAIRN_PROGRAM, {"study", "--progress", "json", file, "-o", results()}, signal,
                    "\"stage\":\"3/12 ");
    EXPECT_EQ(stopped.exit_code, 128 + signal) << stopped.err;
    const auto done = runs();
    ASSERT_GE(done.size(), 2U);
    ASSERT_LT(done.size(), 12U);
    EXPECT_FALSE(fs::exists(fs::path(results()) / "results.json"));
    ASSERT_EQ(run(file).exit_code, 0);
    EXPECT_EQ(timeless(result_file()), undisturbed);
    const auto all = runs();
    EXPECT_EQ(all.size(), 12U);
    for (const auto& [name, bytes] : done) EXPECT_EQ(all.at(name), bytes);
  }
}

TEST_F(Study, ARunIsBelievedOnlyIfItIsWholeAndOfTheseScansAndSettings) {
  ASSERT_EQ(run(study("repetitions = 1\n")).exit_code, 0);
  const auto first = runs();
  ASSERT_EQ(first.size(), 4U);
  ASSERT_EQ(run(study("repetitions = 1\n")).exit_code, 0);
  EXPECT_EQ(runs(), first);
  write_text(fs::path(results()) / "runs" / first.begin()->first, "{\"key\": 3}");
  fs::remove(folder_ / "small.las");
  write_wavy_las(folder_ / "small.las", 4000);
  ASSERT_EQ(run(study("repetitions = 1\n")).exit_code, 0);
  const auto second = runs();
  EXPECT_EQ(second.size(), 6U);  // two of the other scans are there beside those of the first
  EXPECT_EQ(result_file()["inputs"][1]["points"], 4000);
}

TEST_F(Study, WhatFailsIsToldAndDoesNotLoseTheOthers) {
  write_text(folder_ / "small.las", "nonsense");
  const Outcome outcome = run(study());
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_EQ(lines_of(outcome.err).size(), 2U) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("cairn: error: small, cluster: "));
  EXPECT_THAT(outcome.out, HasSubstr("\nfirst failed: "));
  const Json all = result_file()["results"];
  EXPECT_EQ(all[0]["failure"], nullptr);
  EXPECT_TRUE(all[0]["metrics"].contains("rms"));
  EXPECT_TRUE(all[2]["failure"].is_string());
}

TEST_F(Study, AnInputThatCannotBeReadDoesNotLoseTheOthers) {
  const std::string file =
      folder_.write("s.toml",
                    "repetitions = 1\n[[input]]\nname = \"gone\"\ncampaign = \"gone.toml\"\n"
                    "[[input]]\nname = \"small\"\nscans = [\"small.las\"]\n"
                    "[[input]]\nname = \"none\"\nscans = [\"no*.las\"]\n"
                    "[settings]\nnode_points = 300\n[sweep]\nfanout = [3, 4, 64]\n");
  const Outcome outcome = run(file);
  EXPECT_GT(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("gone"), HasSubstr("none, fanout 3: ")));
  const Json all = result_file()["results"];
  ASSERT_EQ(all.size(), 9U);
  for (const Json& result : all)
    EXPECT_EQ(result["failure"].is_null(), result["input"] == "small") << result["failure"];
  // Of all that failed there is nothing to recommend: their code is the answer.
  const std::string gone =
      folder_.write("g.toml", "[[input]]\nname = \"gone\"\nscans = [\"gone.las\"]\n");
  fs::remove_all(results());
  const Outcome failed = run(gone, {"--recommend", "rms <= 1"});
  EXPECT_EQ(failed.exit_code, 4) << failed.err;
}

TEST_F(Study, NoTwoColumnsOfTheTableHaveOneName) {
  const std::string file = folder_.write(
      "s.toml",
      "repetitions = 1\n[[input]]\nname = \"small\"\nscans = [\"small.las\"]\n"
      "[settings]\nnode_points = 300\n[sweep]\nfanout = [3, \"auto\"]\nthin = [1, 50]\n");
  ASSERT_EQ(run(file).exit_code, 0);
  const std::string header = lines_of(read_text(fs::path(results()) / "results.csv"))[0];
  std::set<std::string> names;
  std::istringstream in(header);
  for (std::string name; std::getline(in, name, ',');)
    EXPECT_TRUE(names.insert(name).second) << name;
  EXPECT_TRUE(names.contains("tree_fanout"));
  // What thinning takes away was in the input all the same.
  const Json all = result_file();
  EXPECT_EQ(all["inputs"][0]["points"], 3000);
  for (const Json& result : all["results"]) {
    const Json& metrics = result["metrics"];
    EXPECT_DOUBLE_EQ(metrics["build_s_per_M"]["median"],
                     metrics["build_s"]["median"].get<double>() * 1e6 / 3000);
    EXPECT_LE(metrics["points_kept"], 3000);
  }
}

TEST_F(Study, ARecommendationIsWrittenAndBuilds) {
  const std::string file = study("repetitions = 1\nat = \"20%\"\n");
  const Outcome none = run(file, {"--recommend", "rms <= 1nm"});
  EXPECT_EQ(none.exit_code, 2);
  const Outcome missed = run(file, {"--recommend", "rms@1 <= 0.001mm"});
  EXPECT_EQ(missed.exit_code, 1);
  EXPECT_THAT(missed.err,
              HasSubstr("no setting meets 'rms@1 <= 0.001mm' on all inputs; nearest is"));
  const fs::path written = fs::path(results()) / "recommended.toml";
  EXPECT_FALSE(fs::exists(written));
  const Outcome found = run(file, {"--recommend", "rms <= 1000m", "--within", "9999s/1M"});
  ASSERT_EQ(found.exit_code, 0) << found.err;
  EXPECT_THAT(read_text(written), HasSubstr("\nreducer = \"cluster\"\n"));
  EXPECT_THAT(found.out, HasSubstr("rms at 20 % of the points drawn"));
  EXPECT_EQ(build({folder_ / "wavy.las", "--config", written}).exit_code, 0);
  EXPECT_EQ(info()["parameters"]["reducer"], "cluster");
  EXPECT_EQ(run(file, {"--recommend", "rms < 9000m", "--write", written}).exit_code, 2);
  EXPECT_EQ(run(file, {"--recommend", "rms < 9000m", "--write", written, "--force"}).exit_code, 0);
}

TEST_F(Study, PicturesAreThoseOfMeasure) {
  const std::string file = folder_.write(
      "s.toml",
      "repetitions = 1\n[[input]]\nname = \"wavy\"\nscans = [\"wavy.las\"]\n[settings]\n"
      "node_points = 300\n[pictures]\nbudgets = [\"2k\"]\ndraw = [\"auto\", "
      "\"points\"]\nsize = [160, 90]\n");
  const Outcome outcome = run(file, {"--keep", "--recommend", "psnr@2k >= 5dB"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json metrics = result_file()["results"][0]["metrics"];
  const fs::path dataset = fs::path(results()) / "datasets/wavy, as given.cairn";
  const Json measured = Json::parse(cairn({"measure", "--json", "--progress", "none", "--budget",
                                           "2k", "--size", "160x90", dataset.string()})
                                        .out);
  const Json mean = measured["pictures"]["means"][0];
  EXPECT_EQ(metrics["psnr@2k"], mean["psnr"]);
  EXPECT_EQ(metrics["ssim@2k"], mean["ssim"]);
  EXPECT_EQ(metrics["holes@2k"], mean["holes"]);
  EXPECT_TRUE(metrics.contains("psnr@2k_points"));
  EXPECT_GT(metrics["frame_ms@2k_points"], 0);
}

TEST_F(Study, ASceneIsSimulatedOnce) {
  folder_.write("scene.toml",
                "[[object]]\ntype = \"sphere\"\nradius = 1\n[[station]]\nposition = [3, 0, "
                "0]\ncounts = [200, 100]\n");
  const std::string file = folder_.write("s.toml",
                                         "repetitions = 1\n[[input]]\nname = \"ball\"\nscene = "
                                         "\"scene.toml\"\n[settings]\nnode_points = 100\n");
  ASSERT_EQ(run(file).exit_code, 0);
  const fs::path scan = fs::path(results()) / "scans/ball/campaign.toml";
  const auto made = fs::last_write_time(scan);
  ASSERT_EQ(run(file).exit_code, 0);
  EXPECT_EQ(fs::last_write_time(scan), made);
  const Json before = result_file()["inputs"][0]["points"];
  folder_.write("scene.toml", read_text(folder_ / "scene.toml") + "max_range = 2.05\n");
  ASSERT_EQ(run(file).exit_code, 0);
  EXPECT_LT(result_file()["inputs"][0]["points"], before);
}

TEST_F(Study, KilledWhileItMarksItsFolderItGoesOn) {
  folder_.write("out/cairn-study.1.part", "");
  EXPECT_EQ(run(study()).exit_code, 0);
}

TEST_F(Study, AFolderOfTheUsersIsNotTaken) {
  folder_.write("out/runs/precious.txt", "mine");
  const Outcome outcome = run(study());
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("is not the folder of a study"));
}

}  // namespace
}  // namespace cairn::test
