// What goes wrong while a dataset is built, and clouds whose shape made others slow or large: a full disk, a kill over an
// earlier result, a stray point far away, points that fill a volume.
#include <cmath>
#include <csignal>
#include <fstream>
#include <random>
#include <thread>

#include "tests/hard_cases/clouds.h"
#include "tests/hard_cases/trouble.h"
#include "tests/support/sanitizers.h"
#include "tests/support/small_disk.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

std::string percent(double ratio) { return std::to_string(std::lround(100 * ratio)) + " %"; }

/// An earlier good result, and another command that replaces it.
class TroubleMeanwhile : public TroubleTest {
 protected:
  void SetUp() override {
    old_command_ = {write_wavy_las(folder_ / "old.las", 5000)};
    new_command_ = {write_wavy_las(folder_ / "new.las", 200'000), "--node-points", "8192"};
    const auto start = std::chrono::steady_clock::now();
    new_ = bytes_of(new_command_);
    new_time_ = std::chrono::duration_cast<std::chrono::milliseconds>(
        std::chrono::steady_clock::now() - start);
    old_ = bytes_of(old_command_);
  }

  /// Of an undisturbed build.
  Bytes bytes_of(std::vector<std::string> command) {
    command.emplace_back("--force");
    const Outcome outcome = build_at(folder_ / "undisturbed.cairn", command);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return read(folder_ / "undisturbed.cairn");
  }

  void put_old(const fs::path& dataset) {
    fs::remove_all(dataset);
    fs::remove_all(dataset.string() + ".work");
    ASSERT_EQ(build_at(dataset, old_command_).exit_code, 0);
  }

  std::vector<std::string> old_command_, new_command_;
  Bytes old_, new_;
  std::chrono::milliseconds new_time_{};
};

TEST_F(TroubleMeanwhile, AKillOverAnEarlierResultLeavesItWhole) {
  put_old(output());
  std::vector<std::string> arguments{"build", "--progress", "none", "-o", output(), "--force"};
  arguments.insert(arguments.end(), new_command_.begin(), new_command_.end());
  std::mt19937 random(1);
  int kept = 0, replaced = 0;
  while (kept + replaced < 8 && !HasFailure()) {
    RunningProgram program(CAIRN_PROGRAM, arguments);
    std::this_thread::sleep_for(random() % 1000 * new_time_ / 1000);
    program.signal(SIGKILL);
    program.wait();
    const Bytes found = read(output());
    expect_sound();
    if (found == new_) {
      ++replaced;
      put_old(output());
    } else {
      ++kept;
      EXPECT_TRUE(found == old_);
    }
  }
  EXPECT_GT(kept, 0);
  arguments.erase(arguments.begin(), arguments.begin() + 3);
  EXPECT_EQ(run("build", arguments).exit_code, 0);
  EXPECT_TRUE(read(output()) == new_);
  expect_sound();
  EXPECT_FALSE(fs::exists(output() + ".work"));
  tell("killed over an earlier result",
       "PotreeConverter: old metadata beside a truncated new octree",
       "the earlier dataset byte for byte, or the new one if its last step was done (8 kills at "
       "random moments). The same command then ends with the bytes of an undisturbed build");
}

/// A disk that others use, too.
class SharedDisk : public SmallDisk {
 public:
  using SmallDisk::SmallDisk;

  /// Takes all space but this, as far as it gets it: a program that is being stopped may still take some.
  void leave(std::uint64_t free_bytes) const {
    const std::uint64_t available = fs::space(path()).available;
    if (available <= free_bytes) return;
    std::ofstream(ballast()) << std::string(available - free_bytes, 'x');
  }
  void make_room() const { fs::remove(ballast()); }

 private:
  fs::path ballast() const { return path() / "ballast"; }
};

TEST_F(TroubleMeanwhile, ADiskWithoutRoomIsToldBeforeAnythingIsDone) {
  const SharedDisk disk(folder_ / "disk", "128m");
  if (!disk.mounted()) GTEST_SKIP() << "only root may mount a file system";
  const fs::path dataset = folder_ / "disk/site.cairn", work = dataset.string() + ".work";
  new_command_.emplace_back("--force");
  std::string line;
  for (const std::uint64_t free_mib : {1, 5, 20}) {
    SCOPED_TRACE(free_mib);
    put_old(dataset);
    disk.leave(free_mib << 20);
    const Outcome full = build_at(dataset, new_command_);
    EXPECT_EQ(full.exit_code, 4);
    line = error_of(full);
    EXPECT_THAT(line, ::testing::ContainsRegex("found [0-9]+ bytes free, expected [0-9]+"));
    EXPECT_TRUE(read(dataset) == old_);
    EXPECT_FALSE(fs::exists(work));
    disk.make_room();
    EXPECT_EQ(build_at(dataset, new_command_).exit_code, 0);
    EXPECT_TRUE(read(dataset) == new_);
  }
  tell("a disk with 1, 5 or 20 MiB free", "PotreeConverter: crash",
       "exit 4: " + line +
           ". The earlier result stands; with room, the same command ends with the right bytes");
}

TEST_F(TroubleMeanwhile, ADiskThatOthersFillLeavesTheEarlierResult) {
  const SharedDisk disk(folder_ / "disk", "128m");
  if (!disk.mounted()) GTEST_SKIP() << "only root may mount a file system";
  const fs::path dataset = folder_ / "disk/site.cairn";
  std::vector<std::string> arguments{"build", "--progress", "json", "-o", dataset, "--force"};
  arguments.insert(arguments.end(), new_command_.begin(), new_command_.end());
  std::string line;
  for (const std::string stage : {"import", "cluster", "index"}) {
    SCOPED_TRACE(stage);
    const std::string begin = R"("begin","stage":")" + stage;
    put_old(dataset);
    RunningProgram program(CAIRN_PROGRAM, arguments);
    while (program.running() && program.err().find(begin) == std::string::npos)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    program.signal(SIGSTOP);
    disk.leave(0);
    program.signal(SIGCONT);
    const Outcome full = program.wait(std::chrono::minutes(2));
    disk.make_room();
    // On a slow machine a stage may be over before its beginning is seen.
    if (full.exit_code != 0) {
      EXPECT_EQ(full.exit_code, 4);
      line = error_of(full);
      EXPECT_THAT(line, HasSubstr("No space left on device"));
      EXPECT_TRUE(read(dataset) == old_);
      EXPECT_EQ(run("build", {arguments.begin() + 3, arguments.end()}).exit_code, 0);
    }
    EXPECT_TRUE(read(dataset) == new_);
  }
  EXPECT_NE(line, "");
  tell("a disk that others fill meanwhile", "not tried",
       "exit 4: " + line +
           ". The earlier result stands; with room, the same command goes on and ends with the "
           "right bytes");
}

TEST_F(TroubleMeanwhile, TwoRunsGiveTheSameBytes) {
  EXPECT_TRUE(bytes_of(new_command_) == new_);
  tell("two runs", "PotreeConverter: different bytes", "the same bytes");
}

using Steps = std::vector<std::array<std::int32_t, 3>>;

/// Clouds of about the same size, which should cost about the same memory. (tests/bench/shapes.py measures time.)
class TroubleShape : public TroubleTest {
 protected:
  static constexpr std::size_t kPoints = 1'000'000;

  /// A kilometre of waves.
  static Steps surface() {
    Steps steps = random_steps(kPoints, 0, 999'999, 4);
    for (auto& [x, y, z] : steps)
      z = static_cast<std::int32_t>(20'000 * std::sin(x / 50'000.0) * std::cos(y / 70'000.0));
    return steps;
  }

  /// With one thread: what several hold at the same time is a matter of luck.
  json build_sound(const Steps& steps) {
    write_las(folder_ / "cloud.las", {}, steps);
    const Outcome built = build_at(output(), {folder_ / "cloud.las", "--force", "--threads", "1"});
    EXPECT_EQ(built.exit_code, 0) << built.err;
    json told = expect_sound({"--against", folder_ / "cloud.las"});
    EXPECT_EQ(told.at("points"), steps.size());
    return told;
  }

  /// Of the last build.
  double peak_memory_bytes() const {
    return json::parse(read_text(fs::path(output()) / "run.json")).at("peak_memory_bytes");
  }
};

TEST_F(TroubleShape, AStrayPointFarAwayCostsNothing) {
  Steps steps = surface();
  build_sound(steps);
  const double without = peak_memory_bytes();
  steps.push_back({100'000'000, 0, 0});  // 100 km
  build_sound(steps);
  const double ratio = peak_memory_bytes() / without;
  if (kPeakMemoryCounts) EXPECT_LT(ratio, 1.2);
  tell("a point 100 km away from a million", "PotreeConverter: twice the memory, one thread",
       "exit 0: every point kept, equal nodes; " + percent(ratio) +
           " of the memory that it takes without");
}

TEST_F(TroubleShape, AVolumeCostsWhatASurfaceDoes) {
  build_sound(surface());
  const double surface_bytes = peak_memory_bytes();
  const json told = build_sound(random_steps(kPoints, 0, 999'999, 4));
  const double ratio = peak_memory_bytes() / surface_bytes;
  if (kPeakMemoryCounts) EXPECT_LT(ratio, 1.2);
  tell("points that fill a volume",
       "PotreeConverter: ten times as long, or 2 of 20 million points in the root",
       "exit 0: " + told.at("levels").at(0).at("points").dump() +
           " of a million points in the root, as in any inner node; " + percent(ratio) +
           " of the memory of a surface");
}

}  // namespace
}  // namespace cairn::test
