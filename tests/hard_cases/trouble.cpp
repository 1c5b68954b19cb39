#include "tests/hard_cases/trouble.h"

#include <csignal>

namespace cairn::test {

namespace fs = std::filesystem;
using nlohmann::json;

Outcome TroubleTest::run(const std::string& command, const std::vector<std::string>& arguments) {
  std::vector<std::string> all{command, "--progress", "none"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  RunningProgram program(CAIRN_PROGRAM, all);
  // Many times what any of them takes, sanitizers included.
  const Outcome outcome = program.wait(std::chrono::minutes(2));
  EXPECT_NE(outcome.exit_code, 128 + SIGKILL) << "does not end";
  EXPECT_LT(outcome.exit_code, 128) << outcome.err;
  return outcome;
}

Outcome TroubleTest::build_at(const fs::path& dataset, const std::vector<std::string>& arguments) {
  std::vector<std::string> all{"-o", dataset};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return run("build", all);
}

TroubleTest::Bytes TroubleTest::read(const fs::path& dataset) {
  Bytes bytes;
  for (const char* file : {"index.bin", "nodes.bin", "metadata.json"})
    bytes[file] = read_text(dataset / file);
  return bytes;
}

std::string TroubleTest::error_of(const Outcome& outcome) const {
  const std::vector<std::string> lines = lines_of(outcome.err);
  EXPECT_EQ(lines.size(), 1U) << outcome.err;
  if (lines.empty()) return {};
  const std::string start = "cairn: error: ", folder = folder_ / "";
  EXPECT_THAT(lines[0], ::testing::StartsWith(start));
  std::string shown = lines[0].substr(start.size());
  for (auto at = shown.find(folder); at != std::string::npos; at = shown.find(folder))
    shown.erase(at, folder.size());
  return shown;
}

json TroubleTest::expect_sound(const std::vector<std::string>& verify_flags) {
  std::vector<std::string> arguments{output()};
  arguments.insert(arguments.end(), verify_flags.begin(), verify_flags.end());
  const Outcome verified = run("verify", arguments);
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;

  json told = info();
  const json& tree = told.at("tree");
  const auto least = tree.at("leaf_points").at("min").get<std::uint64_t>();
  EXPECT_LE(tree.at("leaf_points").at("max"), least + 1);
  for (const json& level : told.at("levels")) {
    const bool leaves = level == told.at("levels").back();
    EXPECT_EQ(level.at("points"), leaves ? told.at("points").get<std::uint64_t>()
                                         : level.at("nodes").get<std::uint64_t>() *
                                               tree.at("node_points").get<std::uint64_t>());
  }
  return told;
}

void TroubleTest::tell(const std::string& trouble, const std::string& others,
                       const std::string& answer) {
  RecordProperty("trouble", trouble);
  RecordProperty("others", others);
  RecordProperty("answer", answer);
}

}  // namespace cairn::test
