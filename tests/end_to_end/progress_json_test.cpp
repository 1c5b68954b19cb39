// --progress json of the real program, held to the table of the README field by field.
#include <map>
#include <sstream>

#include "tests/end_to_end/program_test.h"
#include "tests/support/readme_table.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

using Json = nlohmann::json;
using ::testing::AnyOf;

/// Whether a value has the type that the table tells.
bool is_of(const Json& value, const std::string& type) {
  if (type == "integer") return value.is_number_unsigned();
  if (type == "string") return value.is_string();
  if (type == "number") return value.is_number();
  if (type == "number or null") return value.is_number() || value.is_null();
  ADD_FAILURE() << "the README tells a type that this test does not know: " << type;
  return false;
}

class ProgressJson : public ProgramTest {
 protected:
  void SetUp() override {
    for (const auto& row : markdown_table(CAIRN_SOURCE "/README.md", "## Progress for programs"))
      fields_[row.at(0).substr(1, row.at(0).size() - 2)] = row.at(1);
    ASSERT_GE(fields_.size(), 9U);
  }

  /// All lines on stderr are events, each with just the fields of the table and their types.
  std::vector<Json> events_of(const Outcome& outcome) {
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    std::vector<Json> events;
    std::istringstream lines(outcome.err);
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with("{")) continue;
      events.push_back(Json::parse(line));
      EXPECT_EQ(events.back().size(), fields_.size()) << line;
      for (const auto& [name, type] : fields_) {
        EXPECT_TRUE(events.back().contains(name) && is_of(events.back().at(name), type))
            << name << " is no " << type << " in " << line;
      }
    }
    return events;
  }

  /// Stages follow each other: begin, any number of looks that never go back, end.
  void expect_well_formed(const std::vector<Json>& events) {
    std::string stage;
    std::uint64_t points = 0;
    double elapsed = 0;
    for (const Json& event : events) {
      SCOPED_TRACE(event.dump());
      EXPECT_EQ(event.at("version"), 1);
      const std::string what = event.at("event");
      if (what == "begin") {
        EXPECT_EQ(stage, "");
        stage = event.at("stage");
        points = 0;
        elapsed = 0;
        EXPECT_EQ(event.at("points"), 0);
        EXPECT_TRUE(event.at("left_s").is_null());
      }
      EXPECT_THAT(what, AnyOf("begin", "progress", "end"));
      EXPECT_EQ(event.at("stage"), stage);
      EXPECT_GE(event.at("points"), points);
      EXPECT_GE(event.at("elapsed_s"), elapsed);
      EXPECT_GE(event.at("share"), 0);
      EXPECT_LE(event.at("share"), 1);
      points = event.at("points");
      elapsed = event.at("elapsed_s");
      if (elapsed > 0)
        EXPECT_NEAR(event.at("points_per_s"), static_cast<double>(points) / elapsed,
                    1e-6 * static_cast<double>(points) / elapsed);
      if (what != "end") continue;
      EXPECT_EQ(event.at("share"), 1);
      stage.clear();
    }
    EXPECT_EQ(stage, "");
  }

  std::map<std::string, std::string> fields_;  ///< of the README: name and type
};

TEST_F(ProgressJson, EveryEventHasTheFieldsThatTheReadmeTells) {
  const std::string scan = write_wavy_las(folder_ / "wavy.las", 20000);
  const auto built = events_of(
      cairn({"build", scan, "-o", output(), "--node-points", "500", "--progress", "json"}));
  expect_well_formed(built);
  std::map<std::string, std::uint64_t> handled;
  for (const Json& event : built)
    if (event.at("event") == "end") handled[event.at("stage")] = event.at("points");
  EXPECT_EQ(handled.at("import"), 20000U);
  EXPECT_EQ(handled.at("cluster"), 20000U);
  EXPECT_TRUE(handled.contains("split") && handled.contains("index"));

  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"verify", output(), "--against", scan},
                                             {"measure", output()},
                                             {"export", output(), "-o", folder_ / "back.las"}}) {
    std::vector<std::string> words = arguments;
    words.insert(words.end(), {"--progress", "json"});
    const auto events = events_of(cairn(words));
    SCOPED_TRACE(arguments.front());
    EXPECT_GE(events.size(), 2U);
    expect_well_formed(events);
  }
}

}  // namespace
}  // namespace cairn::test
