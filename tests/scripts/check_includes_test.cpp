// scripts/check_includes.py, on trees of a few files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace cairn::test {
namespace {

using ::testing::HasSubstr;

class CheckIncludes : public ::testing::Test {
 protected:
  /// The outcome where `source` includes `included`, beside files that are right.
  Outcome check(const std::string& source, const std::string& included) {
    const TemporaryFolder root;
    for (const char* file : {"formats/error.h", "stages/context.h", "stages/split/split.h",
                             "stages/pack.h", "stages/pack.cpp", "pipeline/build.h"})
      write_text(root / file, "#pragma once\n");
    write_text(root / source, "#include \"" + included + "\"\n");
    return run_program("/usr/bin/env", {"python3", CAIRN_SOURCE "/scripts/check_includes.py",
                                        root.path().string()});
  }
};

TEST_F(CheckIncludes, ArrowsDownwardsAreAllowed) {
  for (const auto& [source, included] : std::vector<std::pair<std::string, std::string>>{
           {"pipeline/build.cpp", "stages/split/split.h"},
           {"pipeline/build.cpp", "pipeline/build.h"},
           {"stages/split/split.cpp", "stages/split/split.h"},
           {"stages/split/split.cpp", "stages/context.h"},
           {"stages/split/split.cpp", "formats/error.h"}}) {
    const Outcome outcome = check(source, included);
    EXPECT_EQ(outcome.exit_code, 0) << source << ": " << outcome.err;
  }
}

TEST_F(CheckIncludes, AllOthersAreNamedWithFileAndLine) {
  for (const auto& [source, included] : std::vector<std::pair<std::string, std::string>>{
           {"formats/error.cpp", "stages/context.h"},
           {"formats/error.cpp", "pipeline/build.h"},
           {"stages/split/split.cpp", "pipeline/build.h"},
           {"stages/split/split.cpp", "stages/pack.h"},
           {"stages/pack.cpp", "stages/split/split.h"},
           {"pipeline/build.cpp", "formats/missing.h"}}) {
    const Outcome outcome = check(source, included);
    EXPECT_EQ(outcome.exit_code, 1) << source;
    EXPECT_THAT(outcome.err, HasSubstr(source + ":1: \"" + included + "\""));
  }
}

}  // namespace
}  // namespace cairn::test
