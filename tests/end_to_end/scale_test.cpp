// What may not depend on threads or memory: the bytes of a dataset. And what memory may not exceed.
#include <cmath>
#include <cstdio>
#include <cstring>

#include "tests/end_to_end/program_test.h"
#include "tests/support/environment.h"
#include "tests/support/sanitizers.h"

namespace cairn::test {
namespace {

/// A build's settings that must not show in its result.
struct Machine {
  const char* threads;
  const char* memory;
};

class ScaleTest : public ProgramTest {
 protected:
  std::string make_scan(const std::string& name, const std::string& points,
                        const std::string& shape) {
    const std::string path = folder_ / name;
    const Outcome made =
        run_program(CAIRN_MAKE_SCAN, {"--points", points, "--shape", shape, "-o", path});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    return path;
  }

  /// The bytes of the dataset's three files, built with these settings.
  std::string dataset_bytes(const std::vector<std::string>& scans, const std::string& node_points,
                            const Machine& machine) {
    std::vector<std::string> arguments = scans;
    arguments.insert(arguments.end(), {"--force", "--node-points", node_points, "--threads",
                                       machine.threads, "--memory", machine.memory});
    const Outcome built = build(arguments);
    EXPECT_EQ(built.exit_code, 0) << built.err;
    std::string bytes;
    for (const char* file : {"index.bin", "nodes.bin", "metadata.json"})
      bytes += read_text(std::filesystem::path(output()) / file);
    return bytes;
  }

  nlohmann::json run_record() {
    return nlohmann::json::parse(read_text(std::filesystem::path(output()) / "run.json"));
  }

  void expect_same_bytes(const std::vector<std::string>& scans, const std::string& node_points,
                         const std::vector<Machine>& machines) {
    std::string first;
    for (const Machine& machine : machines) {
      const std::string bytes = dataset_bytes(scans, node_points, machine);
      if (first.empty()) first = bytes;
      // Compared as a truth: a failure must not print megabytes.
      EXPECT_TRUE(bytes == first) << machine.threads << " threads, " << machine.memory;
      if (!kPeakMemoryCounts) continue;
      const nlohmann::json record = run_record();
      EXPECT_LE(record["peak_memory_bytes"].get<double>(),
                1.1 * record["memory_limit_bytes"].get<double>())
          << machine.memory;
    }
  }
};

using Scale = ScaleTest;
using LongScale = ScaleTest;

/// A binary PLY of doubles, whose points on a wavy square carry `attributes` equal ones of their own.
std::string write_wide_ply(const std::filesystem::path& path, int count, int attributes) {
  std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                     std::to_string(count) +
                     "\nproperty double x\nproperty double y\nproperty double z\n";
  for (int a = 0; a < attributes; ++a) text += "property double a" + std::to_string(a) + "\n";
  text += "end_header\n";
  const std::size_t stride = 3 + static_cast<std::size_t>(attributes);
  std::vector<double> record(stride, 1.5);
  std::string bytes(stride * sizeof(double), '\0');
  for (int i = 0; i < count; ++i) {
    record[0] = i % 1000 * 0.25;
    record[1] = i / 1000 * 0.25;
    record[2] = std::sin(record[0]) * std::cos(record[1]);
    std::memcpy(bytes.data(), record.data(), bytes.size());
    text += bytes;
  }
  write_text(path, text);
  return path.string();
}

TEST_F(Scale, PeakStaysWithinTheLimitWhereTheWorkArraysAreThreeTimesThat) {
  // 600,000 records of 3 + 42 doubles: 206 MiB.
  const std::string scan = write_wide_ply(folder_ / "wide.ply", 600'000, 42);
  const Outcome built = build({scan, "--node-points", "2000", "--threads", "2", "--memory", "64MiB",
                               "--reducer", "first", "--codec", "none"});
  ASSERT_EQ(built.exit_code, 0) << built.err;
  if (!kPeakMemoryCounts) return;
  const nlohmann::json record = run_record();
  EXPECT_LE(record["peak_memory_bytes"].get<double>(), record["memory_limit_bytes"].get<double>());
}

TEST_F(Scale, RefusesNodesThatDoNotFitTheMemory) {
  const std::string scan = make_scan("a.las", "400000", "statue");
  const auto build_within = [&](int mebibytes) {
    return build({scan, "--memory", std::to_string(mebibytes) + "MiB", "--node-points", "200000",
                  "--fanout", "2"});
  };
  const Outcome outcome = build_within(64);
  expect_refusal(outcome, 2);
  // The least memory that it names is just that.
  int least = 0;
  const std::size_t at = outcome.err.find("raise memory to ");
  ASSERT_NE(at, std::string::npos) << outcome.err;
  ASSERT_EQ(std::sscanf(outcome.err.c_str() + at, "raise memory to %dMiB", &least), 1);
  expect_refusal(build_within(least - 1), 2);
  EXPECT_EQ(build_within(least).exit_code, 0);
}

TEST_F(Scale, SameBytesFromAnyThreadsAndMemory) {
  const std::vector<std::string> scans{make_scan("a.las", "700000", "statue"),
                                       make_scan("b.ply", "600000", "facade")};
  expect_same_bytes(scans, "4000", {{"1", "1GiB"}, {"2", "64MiB"}, {"7", "1GiB"}, {"7", "64MiB"}});
}

TEST_F(Scale, SameBytesFromAnyVectorInstructions) {
  const std::vector<std::string> scans{make_scan("a.ply", "60000", "statue")};
  for (const char* reducer : {"cluster", "random"}) {
    std::string first;
    for (const char* path : {"portable", "avx2", "avx512"}) {
      const Environment environment({{std::string("CAIRN_VECTOR_PATH"), path}});
      ASSERT_EQ(
          build({scans[0], "--node-points", "2000", "--reducer", reducer, "--force"}).exit_code, 0);
      std::string bytes;
      for (const char* file : {"index.bin", "nodes.bin"})
        bytes += read_text(std::filesystem::path(output()) / file);
      if (first.empty()) first = bytes;
      EXPECT_TRUE(bytes == first) << reducer << " " << path;
    }
  }
}

TEST_F(LongScale, SameBytesFromTwentyMillionPointsAndPeakWithinTheLimit) {
  expect_same_bytes({make_scan("a.las", "20000000", "statue")}, "65536",
                    {{"1", "4GiB"}, {"2", "256MiB"}, {"7", "256MiB"}, {"7", "4GiB"}});
}

TEST_F(LongScale, TwentyEightMillionPointsAreUniformAndVerified) {
  const std::string scan = make_scan("a.ply", "28000000", "statue");
  ASSERT_EQ(build({scan}).exit_code, 0);
  const nlohmann::json tree = info()["tree"];
  EXPECT_LE(tree["leaf_points"]["max"].get<int>() - tree["leaf_points"]["min"].get<int>(), 1);
  EXPECT_EQ(tree["inner_points"]["min"], tree["node_points"]);
  EXPECT_EQ(tree["inner_points"]["max"], tree["node_points"]);
  const Outcome verified = cairn({"verify", "--progress", "none", output(), "--against", scan});
  EXPECT_EQ(verified.exit_code, 0) << verified.out;
}

TEST_F(LongScale, TheCorridorIsTheSameScansAndTheSameBytesEveryTimeWithinTheLimit) {
  const auto simulate = [&](const std::string& folder, const char* threads) {
    const Outcome made =
        cairn({"simulate", CAIRN_SOURCE "/configs/scenes/corridor.toml", "-o", folder, "--points",
               "20000000", "--progress", "none", "--threads", threads});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  };
  const std::filesystem::path scans = folder_ / "corridor", again = folder_ / "again/corridor";
  std::filesystem::create_directory(again.parent_path());
  simulate(scans, "1");
  simulate(again, "7");
  std::size_t files = 0;
  for (const auto& file : std::filesystem::directory_iterator(scans)) {
    EXPECT_TRUE(read_text(file.path()) == read_text(again / file.path().filename())) << file;
    ++files;
  }
  EXPECT_EQ(files, 80U + 2U);  // stations, poses.tsv and campaign.toml
  std::filesystem::remove_all(again);
  expect_same_bytes({scans / "campaign.toml"}, "65536",
                    {{"1", "256MiB"}, {"2", "256MiB"}, {"7", "256MiB"}, {"2", "4GiB"}});
  EXPECT_NEAR(info()["points"].get<double>(), 20e6, 1e6);
}

}  // namespace
}  // namespace cairn::test
