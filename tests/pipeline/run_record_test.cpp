#include "pipeline/run_record.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <nlohmann/json.hpp>

#include "formats/error.h"
#include "pipeline/compiled_in.h"
#include "tests/support/temporary_folder.h"

namespace cairn::pipeline {
namespace {

BuildReport sample() {
  return {.stages = {{"import", 1000, 0.5, 0.75, 4096}, {"split", 1000, 0.25, 0.5, 8192}},
          .elapsed_s = 1,
          .threads = 2,
          .memory_limit_bytes = 1 << 30,
          .peak_memory_bytes = 1 << 20,
          .scans = 3,
          .input_bytes = 26000};
}

TEST(RunRecord, ComesBackAsWritten) {
  const test::TemporaryFolder folder;
  write_run_record(folder.path(), sample());
  const auto record = read_run_record(folder.path());
  ASSERT_TRUE(record);
  ASSERT_EQ(record->stages.size(), 2U);
  EXPECT_EQ(record->stages[1].name, "split");
  EXPECT_EQ(record->stages[1].seconds, 0.25);
  EXPECT_EQ(record->stages[1].cpu_seconds, 0.5);
  EXPECT_EQ(record->stages[1].peak_memory_bytes, 8192U);
  EXPECT_EQ(record->threads, 2U);
  EXPECT_EQ(record->scans, 3U);
  EXPECT_EQ(record->peak_memory_bytes, 1U << 20);
}

TEST(RunRecord, TellsRatesVersionAndMachine) {
  const test::TemporaryFolder folder;
  write_run_record(folder.path(), sample());
  const auto json = nlohmann::json::parse(test::read_text(folder / "run.json"));
  EXPECT_EQ(json.at("version"), program_version());
  EXPECT_EQ(json.at("stages").at(0).at("points_per_s"), 2000);
  EXPECT_GT(json.at("machine").at("memory_bytes"), 0);
}

TEST(RunRecord, IsNeverNeeded) {
  const test::TemporaryFolder folder;
  EXPECT_FALSE(read_run_record(folder.path()));
  for (const char* text : {"", "{", "[]", "{}", "{\"elapsed_s\": \"long\"}"}) {
    test::write_text(folder / "run.json", text);
    EXPECT_FALSE(read_run_record(folder.path())) << text;
  }
}

TEST(RunRecord, NumbersOutOfRangeAreNone) {
  const test::TemporaryFolder folder;
  write_run_record(folder.path(), sample());
  const auto whole = nlohmann::json::parse(test::read_text(folder / "run.json"));
  for (const char* key : {"threads", "scans", "peak_memory_bytes"})
    for (const double number : {1e300, -1.0, 0.5}) {
      auto changed = whole;
      changed[key] = number;
      test::write_text(folder / "run.json", changed.dump());
      EXPECT_FALSE(read_run_record(folder.path())) << key << " " << number;
    }
}

TEST(RunRecord, AFullDiskIsASystemError) {
  const test::TemporaryFolder folder;
  std::filesystem::create_symlink("/dev/full", folder / "run.json");
  try {
    write_run_record(folder.path(), sample());
    FAIL() << "no error";
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kSystem);
    EXPECT_EQ(error.parts().system_errno, ENOSPC);
  }
}

}  // namespace
}  // namespace cairn::pipeline
