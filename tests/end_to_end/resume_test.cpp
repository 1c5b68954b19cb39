// Builds that are killed, that run into a full or broken disk, or whose work is damaged meanwhile: the same command, run
// again, ends with the bytes of an undisturbed build, and what stood there before is whole until then.
#include <chrono>
#include <csignal>
#include <map>
#include <random>
#include <thread>

#include "tests/end_to_end/program_test.h"
#include "tests/support/environment.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Resume : public ProgramTest {
 protected:
  void SetUp() override {
    write_wavy_las(folder_ / "a.las", 15000);
    write_wavy_las(folder_ / "b.las", 4500);
    undisturbed_ = bytes_of_a_build(command_);
  }

  using Command = std::vector<std::string>;
  using Bytes = std::map<std::string, std::string>;

  static Bytes read(const std::string& dataset) {
    Bytes bytes;
    for (const char* file : {"index.bin", "nodes.bin", "metadata.json"})
      bytes[file] = read_text(fs::path(dataset) / file);
    return bytes;
  }
  /// Of a build that nothing disturbs, in a place of its own. Names of scans go into the metadata, folders do not.
  Bytes bytes_of_a_build(Command arguments) {
    const std::string place = folder_ / "undisturbed.cairn";
    arguments.insert(arguments.begin(), {"build", "--progress", "none", "--force", "-o", place});
    const Outcome outcome = cairn(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return read(place);
  }

  Outcome build_with_fault(const std::string& fault, int at) {
    const Environment environment({{"LD_PRELOAD", CAIRN_FAULTS},
                                   {"CAIRN_FAULT_FOLDER", output()},
                                   {"CAIRN_FAULT", fault},
                                   {"CAIRN_FAULT_AT", std::to_string(at)}});
    return build(command_);
  }
  int count_calls() {
    const std::string count = folder_ / "count";
    {
      const Environment environment({{"LD_PRELOAD", CAIRN_FAULTS},
                                     {"CAIRN_FAULT_FOLDER", output()},
                                     {"CAIRN_FAULT_COUNT", count}});
      EXPECT_EQ(build(command_).exit_code, 0);
    }
    fs::remove_all(output());
    return std::stoi(read_text(count));
  }

  void expect_undisturbed(const Outcome& outcome) { expect_bytes(outcome, undisturbed_); }
  void expect_bytes(const Outcome& outcome, const Bytes& expected) {
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_TRUE(read(output()) == expected);
    EXPECT_FALSE(fs::exists(output() + ".work"));
  }

  /// Kills a build as late as its work is still needed: before it writes the dataset.
  void kill_late() {
    if (late_call_ == 0) late_call_ = count_calls();
    for (; late_call_ > 0; --late_call_) {
      build_with_fault("kill", late_call_);
      if (fs::exists(output() + ".work/journal") && !fs::exists(output())) return;
      fs::remove_all(output());
    }
    FAIL() << "no build left a journal";
  }

  void test_kills(int step) {
    const int calls = count_calls();
    ASSERT_GT(calls, 40);
    RecordProperty("calls", calls);
    int killed = 0, tried = 0;
    for (int at = 1; at <= calls && !HasFailure(); at += step, ++tried) {
      SCOPED_TRACE(at);
      killed += build_with_fault("kill", at).exit_code == 128 + SIGKILL ? 1 : 0;
      Outcome outcome = build(command_);
      // Killed when even its journal was removed: the dataset is one that exists.
      if (outcome.exit_code == 2 && outcome.err.find("site.cairn exists") != std::string::npos)
        outcome.exit_code = 0;
      expect_undisturbed(outcome);
      fs::remove_all(output());
    }
    EXPECT_GT(killed, tried * 9 / 10);
  }

  /// A disk that is full from a call on, with a dataset in the output's place.
  void test_full_disks(int step) {
    const int calls = count_calls();
    const Command other{folder_ / "b.las", "--force"};
    ASSERT_EQ(build(other).exit_code, 0);
    const Bytes old = read(output());
    command_.emplace_back("--force");
    int full = 0, tried = 0;
    for (int at = 1; at <= calls && !HasFailure(); at += step, ++tried) {
      SCOPED_TRACE(at);
      const Outcome outcome = build_with_fault("ENOSPC", at);
      if (outcome.exit_code == 0) continue;
      ++full;
      ASSERT_EQ(outcome.exit_code, 4) << outcome.err;
      ASSERT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
      EXPECT_THAT(outcome.err, HasSubstr("No space left"));
      EXPECT_TRUE(read(output()) == old);
      expect_undisturbed(build(command_));
      ASSERT_EQ(build(other).exit_code, 0);
    }
    EXPECT_GT(full, tried / 2);
  }

  /// One call that fails.
  void test_broken_calls(int step) {
    const int calls = count_calls();
    int failed = 0, tried = 0;
    for (int at = 1; at <= calls && !HasFailure(); at += step, ++tried) {
      SCOPED_TRACE(at);
      const Outcome outcome = build_with_fault("EIO", at);
      if (outcome.exit_code != 0) {
        ++failed;
        ASSERT_EQ(outcome.exit_code, 4) << outcome.err;
        ASSERT_EQ(lines_of(outcome.err).size(), 1U) << outcome.err;
        EXPECT_FALSE(fs::exists(output()));
        expect_undisturbed(build(command_));
      } else {
        EXPECT_TRUE(read(output()) == undisturbed_);
      }
      fs::remove_all(output());
      fs::remove_all(output() + ".work");
    }
    EXPECT_GT(failed, tried / 2);
  }

  Command command_{folder_ / "a.las", folder_ / "b.las", "--node-points", "400",
                   "--estimate",      "normals",         "--threads",     "2"};
  Bytes undisturbed_;
  int late_call_ = 0;  ///< by which kill_late found it; 0: not yet
};

/// Every call that a build makes; the short tests take some.
class LongResume : public Resume {};

TEST_F(Resume, KilledBeforeACallThatChangesTheDiskItEndsWithTheSameBytes) { test_kills(17); }
TEST_F(LongResume, KilledBeforeAnyCallThatChangesTheDiskItEndsWithTheSameBytes) { test_kills(1); }

TEST_F(Resume, WithEffectsToo) {
  command_.insert(command_.end(), {"--remove-duplicates", "exact", "--outlier-deviations", "1",
                                   "--balance-exposure", "--thin", "5"});
  undisturbed_ = bytes_of_a_build(command_);
  test_kills(41);
}

TEST_F(LongResume, AHundredKillsAtRandomMomentsChangeNothing) {
  write_wavy_las(folder_ / "a.las", 250'000);
  undisturbed_ = bytes_of_a_build(command_);
  Command arguments = command_;
  arguments.insert(arguments.begin(), {"build", "--progress", "none", "-o", output()});
  std::mt19937 random(1);
  int kills = 0, finished = 0;
  while (kills < 100 && !HasFailure()) {
    RunningProgram program(CAIRN_PROGRAM, arguments);
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 2000));
    program.signal(SIGKILL);
    const Outcome outcome = program.wait();
    if (outcome.exit_code == 128 + SIGKILL) {
      ++kills;
      if (!fs::exists(output()) || fs::exists(output() + ".work")) continue;
    }
    ++finished;
    EXPECT_TRUE(read(output()) == undisturbed_);
    fs::remove_all(output());
  }
  RecordProperty("finished", finished);
  expect_undisturbed(build(command_));
}

TEST_F(Resume, AFullDiskLeavesTheOldDatasetAndWorkToGoOnWith) { test_full_disks(29); }
TEST_F(LongResume, AFullDiskLeavesTheOldDatasetAndWorkToGoOnWith) { test_full_disks(1); }

TEST_F(Resume, ACallThatFailsIsOneLineAndTheBuildGoesOn) { test_broken_calls(29); }
TEST_F(LongResume, ACallThatFailsIsOneLineAndTheBuildGoesOn) { test_broken_calls(1); }

TEST_F(Resume, ChangedSettingsAreThoseOfTheBuildThatEnds) {
  const std::vector<Command> changes{{"--theta", "40"},    {"--codec", "none"},
                                     {"--fanout", "3"},    {"--drop", "intensity"},
                                     {"--neighbors", "8"}, {"--memory", "64MiB"}};
  for (const Command& change : changes) {
    SCOPED_TRACE(change[0]);
    kill_late();
    Command changed = command_;
    changed.insert(changed.end(), change.begin(), change.end());
    expect_bytes(build(changed), bytes_of_a_build(changed));
    fs::remove_all(output());
  }
}

TEST_F(Resume, AScanThatChangedIsReadAgain) {
  kill_late();
  write_wavy_las(folder_ / "b.las", 4501);
  expect_bytes(build(command_), bytes_of_a_build(command_));
}

TEST_F(Resume, DamagedWorkIsNotBelieved) {
  std::mt19937 random(1);
  for (int round = 0; round < 4; ++round) {
    SCOPED_TRACE(round);
    kill_late();
    const fs::path work = output() + ".work";
    for (const fs::path& file : {work / "journal", work / "arrays/packed-nodes"}) {
      std::string bytes = read_text(file);
      ASSERT_FALSE(bytes.empty()) << file;
      if (round % 4 == 0 && file.filename() == "journal")
        bytes.resize(random() % bytes.size());
      else if (round % 2 == (file.filename() == "journal" ? 0 : 1))
        for (int i = 0; i < 3; ++i) bytes[random() % bytes.size()] ^= 0x10;
      write_text(file, bytes);
    }
    expect_undisturbed(build(command_));
    if (HasFailure()) return;
    fs::remove_all(output());
  }
}

TEST_F(Resume, WorkArraysThatAreDamagedOrGoneAreMadeAnew) {
  for (const char* stage : {"split", "estimate", "cluster"})
    for (const bool gone : {false, true}) {
      SCOPED_TRACE(stage);
      ASSERT_NO_FATAL_FAILURE(kill_build(command_, stage));
      const fs::path arrays = output() + ".work/arrays";
      if (fs::exists(arrays))
        for (const auto& entry : fs::directory_iterator(arrays)) {
          if (gone) {
            fs::remove(entry.path());
            continue;
          }
          std::string bytes = read_text(entry.path());
          for (std::size_t i = 100; i < bytes.size(); i += 5000) bytes[i] ^= 1;
          write_text(entry.path(), bytes);
        }
      expect_undisturbed(build(command_));
      // Counted once, also where the build had to start over.
      const auto record =
          nlohmann::json::parse(read_text(fs::path(output()) / "run.json"), nullptr, false);
      EXPECT_EQ(record.at("input_bytes"),
                fs::file_size(folder_ / "a.las") + fs::file_size(folder_ / "b.las"));
      if (HasFailure()) return;
      fs::remove_all(output());
    }
}

TEST_F(Resume, FreshStartsOver) {
  kill_late();
  command_.emplace_back("--fresh");
  const Outcome outcome = build(command_);
  EXPECT_THAT(outcome.err, ::testing::Not(HasSubstr("going on")));
  expect_undisturbed(outcome);
}

TEST_F(Resume, AStoppedBuildSaysWhatItKeepsAndGoesOn) {
  write_wavy_las(folder_ / "a.las", 200'000);
  undisturbed_ = bytes_of_a_build(command_);
  Command arguments = command_;
  arguments.insert(arguments.begin(), {"build", "--progress", "json", "-o", output()});
  const Outcome stopped =
      run_program(CAIRN_PROGRAM, arguments, SIGINT, "\"begin\",\"stage\":\"estimate\"");
  EXPECT_EQ(stopped.exit_code, 128 + SIGINT);
  EXPECT_THAT(stopped.err, HasSubstr("site.cairn.work"));
  const Outcome outcome = build(command_);
  EXPECT_THAT(outcome.err, HasSubstr("cairn: note: going on"));
  expect_undisturbed(outcome);
}

}  // namespace
}  // namespace cairn::test
