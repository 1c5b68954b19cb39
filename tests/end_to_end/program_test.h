// What all tests of the real program share.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace cairn::test {

/// A test with a folder of its own, where the program runs on files and leaves what it makes.
class ProgramTest : public ::testing::Test {
 protected:
  Outcome cairn(std::vector<std::string> arguments) {
    return run_program(CAIRN_PROGRAM, arguments);
  }

  /// Builds folder/site.cairn from `arguments`: scans and flags.
  Outcome build(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"build", "--progress", "none", "-o", output()});
    return cairn(std::move(arguments));
  }

  std::string output() const { return folder_ / "site.cairn"; }

  /// Kills a build when a stage begins: something of it is there to go on from, and no dataset. A build that ended before the
  /// kill came is tried again.
  void kill_build(std::vector<std::string> arguments, const std::string& stage) {
    arguments.insert(arguments.begin(), {"build", "--progress", "json", "-o", output()});
    for (int i = 0; i < 20; ++i) {
      run_program(CAIRN_PROGRAM, arguments, SIGKILL, "\"begin\",\"stage\":\"" + stage + "\"");
      if (!std::filesystem::exists(output())) return;
      std::filesystem::remove_all(output());
      std::filesystem::remove_all(output() + ".work");
    }
    FAIL() << "all builds ended before they were killed";
  }

  nlohmann::json info() {
    const Outcome outcome = cairn({"info", "--json", output()});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }

  /// The command refused with this code, one line on stderr, nothing on stdout, and left nothing behind.
  void expect_refusal(const Outcome& outcome, int exit_code) {
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const auto lines = lines_of(outcome.err);
    ASSERT_EQ(lines.size(), 1U) << outcome.err;
    EXPECT_THAT(lines.front(), ::testing::StartsWith("cairn: error: "));
    EXPECT_FALSE(std::filesystem::exists(output()));
    EXPECT_FALSE(std::filesystem::exists(output() + ".work"));
  }

  TemporaryFolder folder_;
};

}  // namespace cairn::test
