// The report agrees with what info tells, with what the scans are known to hold, and with the files' sizes.
#include <functional>

#include "formats/checksum.h"
#include "tests/end_to_end/program_test.h"
#include "tests/support/las_bytes.h"
#include "tests/support/tiny_dataset.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

class Report : public ProgramTest {
 protected:
  Json report() { return Json::parse(cairn({"report", output(), "--json"}).out); }

  /// Changes the metadata; all checksums are right again afterwards.
  void edit_metadata(const std::function<void(Json&)>& change) {
    const fs::path path = fs::path(output()) / "metadata.json";
    Json metadata = Json::parse(read_text(path));
    change(metadata);
    write_text(path, metadata.dump());
    edit_index(output(), [&](formats::DatasetIndex& index) {
      index.head.metadata_size_bytes = fs::file_size(path);
      index.head.metadata_checksum = formats::checksum_of(read_file(path));
    });
  }
};

TEST_F(Report, AgreesWithInfoAndWithTheFiles) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "a.las", 5000), "--node-points", "300"}).exit_code, 0);
  const Json told = info(), report = this->report();
  EXPECT_EQ(report["points"], told["points"]);
  EXPECT_EQ(report["tree"], told["tree"]);
  ASSERT_EQ(report["levels"].size(), told["levels"].size());
  std::uint64_t bytes = 0;
  for (std::size_t l = 0; l < report["levels"].size(); ++l) {
    const Json& level = report["levels"][l];
    EXPECT_EQ(level["rms"], told["levels"][l]["rms"]);
    EXPECT_EQ(level["node_bound"]["max"], told["levels"][l]["bound"]);
    std::uint64_t nodes = 0, points = 0;
    for (const Json& size : level["node_points"]["histogram"]) {
      nodes += size["nodes"].get<std::uint64_t>();
      points += size["nodes"].get<std::uint64_t>() * size["min"].get<std::uint64_t>();
    }
    EXPECT_EQ(level["nodes"], nodes);
    EXPECT_EQ(level["points"], points);
    for (const auto& [name, size] : level["section_bytes"].items())
      bytes += size.get<std::uint64_t>();
  }
  EXPECT_EQ(bytes, fs::file_size(fs::path(output()) / "nodes.bin"));
  // 5000 points: levels by log(5000 / 300) / log N rounded; leaves differ by at most one.
  const Json& leaves = report["levels"].back()["node_points"];
  EXPECT_LE(leaves["max"].get<int>() - leaves["min"].get<int>(), 1);
  EXPECT_EQ(report["levels"].back()["points"], 5000);
}

TEST_F(Report, TheLedgerAddsUpForEveryScan) {
  const std::string cut = write_wavy_las(folder_ / "cut.las", 1000);
  fs::resize_file(cut, 227 + 20 * 600 + 7);
  write_text(folder_ / "nan.ply",
             "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
             "property float z\nend_header\n0 0 0\nnan 0 0\n1 1 1\n");
  ASSERT_EQ(build({cut, folder_ / "nan.ply", "--allow-truncated", "--resolution", "1"}).exit_code,
            0);
  const Json sources = report()["sources"];
  ASSERT_EQ(sources.size(), 2U);
  EXPECT_EQ(sources[0]["claimed"], 1000);
  EXPECT_EQ(sources[0]["kept"], 600);
  EXPECT_EQ(sources[0]["missing"], 400);
  EXPECT_EQ(sources[1]["kept"], 2);
  EXPECT_EQ(sources[1]["dropped"]["non_finite"], 1);
  const std::string text = cairn({"report", output()}).out;
  EXPECT_THAT(text, HasSubstr("nan.ply (PLY ascii)"));
}

TEST_F(Report, TellsRecordsThatAHeaderDoesNotCount) {
  const std::string scan = write_wavy_las(folder_ / "a.las", 1000);
  std::string bytes = read_text(scan);
  constexpr std::size_t kPointCount = 107;
  put_at(bytes, kPointCount, std::uint32_t{600});
  write_text(scan, bytes);
  const Outcome built = build({scan});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  EXPECT_THAT(built.err, HasSubstr("a.las has room for 400 more records behind the 600"));
  EXPECT_EQ(report()["sources"][0]["kept"], 600);
  EXPECT_EQ(report()["sources"][0]["uncounted_records"], 400);
  EXPECT_THAT(cairn({"report", output()}).out,
              HasSubstr("room for 400 more records that its header does not count"));
}

TEST_F(Report, TellsWhatArithmeticDidToThePoints) {
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4000\nproperty double x\n"
      "property double y\nproperty double z\nend_header\n";
  for (int i = 0; i < 4000; ++i)
    text += std::to_string(0.25 * i) + " " + std::to_string(3 * (i * 7 % 4000)) + " 5\n";
  write_text(folder_ / "plane.ply", text);
  ASSERT_EQ(build({folder_ / "plane.ply", "--node-points", "300"}).exit_code, 0);
  const Json report = this->report(), &numerics = report["numerics"];
  EXPECT_EQ(numerics["flat_axes"], Json::array({"z"}));
  ASSERT_EQ(numerics["levels"].size(), report["levels"].size());
  for (std::size_t l = 0; l + 1 < numerics["levels"].size(); ++l)
    EXPECT_EQ(numerics["levels"][l]["mergings"], report["levels"][l + 1]["nodes"]);
  EXPECT_EQ(numerics["levels"].back()["mergings"], 0);
  for (const Json& level : numerics["levels"])
    for (const auto& [name, error] : level["quantization"].items())
      EXPECT_LE(error["largest"], error["bound"]) << name;
  EXPECT_EQ(numerics["scans"][0]["name"], "plane.ply");
  EXPECT_THAT(cairn({"report", output()}).out, HasSubstr("without extent: z"));

  edit_metadata([](Json& metadata) {
    for (Json& level : metadata["levels"]) level.erase("numerics");
  });
  EXPECT_EQ(this->report()["numerics"], nullptr);
  EXPECT_THAT(cairn({"report", output()}).out, Not(HasSubstr("Numerics")));
}

TEST_F(Report, TellsTheCostOfEveryStage) {
  ASSERT_EQ(build({write_tiny_ply(folder_ / "a.ply")}).exit_code, 0);
  const Json run = report()["run"];
  ASSERT_EQ(run["stages"].size(), 5U);
  EXPECT_EQ(run["stages"][0]["name"], "open");
  for (const Json& stage : run["stages"]) {
    EXPECT_GE(stage["cpu_seconds"].get<double>(), 0) << stage;
    EXPECT_GT(stage["peak_memory_bytes"].get<double>(), 0) << stage;
    EXPECT_LE(stage["peak_memory_bytes"], run["peak_memory_bytes"]) << stage;
  }
  fs::remove(fs::path(output()) / "run.json");
  EXPECT_TRUE(report()["run"].is_null());
}

TEST_F(Report, TellsThePointsThatWereReadNotThoseThatWereClaimed) {
  const std::string cut = write_tiny_ply(folder_ / "cut.ply", 900);
  std::string text = read_text(cut);
  text.replace(text.find("vertex 900"), 10, "vertex 900000");
  write_text(cut, text);
  ASSERT_EQ(build({cut, "--allow-truncated"}).exit_code, 0);
  const Json stages = report()["run"]["stages"];
  ASSERT_EQ(stages[1]["name"], "import");
  EXPECT_EQ(stages[1]["points"], 900);
}

TEST_F(Report, TellsTheDatasetItsBoundsAndItsCoordinateSystem) {
  ASSERT_EQ(build({write_tiny_ply(folder_ / "a.ply"), "--crs", "EPSG:25832"}).exit_code, 0);
  const Json report = Json::parse(cairn({"report", output() + "/", "--json"}).out);
  EXPECT_EQ(report["dataset"], "site.cairn");
  EXPECT_EQ(report["bounds"], info()["bounds"]);
  EXPECT_EQ(report["crs"], info()["crs"]);
  EXPECT_EQ(report["crs"]["records"].size(), 1U);
}

TEST_F(Report, TheLedgerTellsACoordinateSystemThatWasReplaced) {
  const std::string plain = write_wavy_las(folder_ / "plain.las", 100);
  const std::string referenced = folder_ / "referenced.las";
  ASSERT_EQ(build({plain, "--crs", "EPSG:25832"}).exit_code, 0);
  EXPECT_THAT(cairn({"report", output()}).out, HasSubstr("coordinate system: EPSG:25832"));
  ASSERT_EQ(cairn({"export", "--progress", "none", output(), "-o", referenced}).exit_code, 0);
  ASSERT_EQ(build({plain, referenced, "--crs", "EPSG:4326", "--force"}).exit_code, 0);
  const Json crs = report()["crs"], sources = report()["sources"];
  EXPECT_FALSE(sources[0].contains("replaced_crs"));
  EXPECT_EQ(sources[1]["replaced_crs"], Json::array({0}));
  EXPECT_EQ(sources[1]["crs"], Json::array());
  EXPECT_EQ(crs["records"].size(), 1U);
  EXPECT_EQ(crs["replaced"].size(), 1U);
  EXPECT_NE(crs["replaced"][0]["data_base64"], crs["records"][0]["data_base64"]);
  const std::string text = cairn({"report", output()}).out;
  EXPECT_THAT(text, HasSubstr("; no coordinate system\n"));
  EXPECT_THAT(text, HasSubstr("; its coordinate system is replaced by EPSG:4326\n"));
}

TEST_F(Report, MetadataWithoutWhatItsFormatDemandsIsBadInput) {
  ASSERT_EQ(build({write_tiny_ply(folder_ / "a.ply")}).exit_code, 0);
  const std::string metadata = read_text(output() + "/metadata.json");
  const std::vector<std::pair<const char*, std::function<void(Json&)>>> damages{
      {"report", [](Json& json) { json.erase("sources"); }},
      {"report", [](Json& json) { json["sources"][0]["bounds"]["max"] = Json::array(); }},
      {"report", [](Json& json) { json["sources"][0]["kept"] = "all"; }},
      {"report", [](Json& json) { json["sources"][0]["kept"] = 1e300; }},
      {"info", [](Json& json) { json["tree"]["nodes"] = 1e300; }},
      {"info", [](Json& json) { json.erase("schema"); }},
      {"info",
       [](Json& json) {
         json["bounds"]["min"] = {1, 2};
       }},
      {"info", [](Json& json) { json["grid"]["step"] = Json::array(); }}};
  for (const auto& [command, damage] : damages) {
    edit_metadata(damage);
    const Outcome outcome = cairn({command, output()});
    EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_THAT(outcome.err, HasSubstr("the metadata lacks what its format demands"));
    edit_metadata([&](Json& json) { json = Json::parse(metadata); });
    EXPECT_EQ(cairn({command, output()}).exit_code, 0);
  }
  edit_metadata([](Json& json) { json.erase("tree"); });
  EXPECT_EQ(cairn({"report", output(), "--json"}).exit_code, 3);
}

TEST_F(Report, NoControlCharactersReachTheTerminal) {
  ASSERT_EQ(build({write_tiny_ply(folder_ / "a.ply")}).exit_code, 0);
  const fs::path record = fs::path(output()) / "run.json";
  Json run = Json::parse(read_text(record));
  run["stages"][0]["name"] = "\x1b[31mred";
  write_text(record, run.dump());
  edit_metadata([](Json& json) { json["sources"][0]["name"] = "\x1b[31mred"; });
  for (const char* command : {"info", "report"}) {
    const std::string text = cairn({command, output()}).out;
    EXPECT_EQ(text.find('\x1b'), std::string::npos) << text;
    EXPECT_THAT(text, HasSubstr("?[31mred"));
  }
}

}  // namespace
}  // namespace cairn::test
