#include "pipeline/workspace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <functional>
#include <optional>

#include "formats/error.h"
#include "pipeline/publish.h"
#include "tests/support/small_disk.h"
#include "tests/support/temporary_folder.h"

namespace cairn::pipeline {
namespace {

namespace fs = std::filesystem;
using formats::Error;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// What a call throws, as "kind: message"; empty if it throws nothing.
template <typename Call>
std::string failure(Call call) {
  try {
    call();
  } catch (const Error& error) {
    return std::to_string(static_cast<int>(error.kind())) + ": " + error.what();
  }
  return "";
}

class WorkspaceTest : public ::testing::Test {
 protected:
  fs::path output() const { return folder_ / "site.cairn"; }
  fs::path work() const { return folder_ / "site.cairn.work"; }

  void write_dataset(const fs::path& at, const std::string& text) {
    test::write_text(at / "index.bin", "CAIRN\r\n\x1a" + text);
    test::write_text(at / "nodes.bin", text);
  }
  std::string open_failure(bool force = false) {
    return failure([&] { Workspace workspace(output(), {}, force); });
  }

  test::TemporaryFolder folder_;
};

TEST_F(WorkspaceTest, AnEmptyFolderInTheWayIsNotToldAsAKilledBuilds) {
  fs::create_directory(work());
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(open_failure(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST_F(WorkspaceTest, PublishesUnderTheNameAndLeavesNothingElse) {
  {
    Workspace workspace(output(), {}, false);
    write_dataset(workspace.dataset_folder(), "new");
    test::write_text(workspace.arrays_folder() / "points", "bulk");
    EXPECT_FALSE(fs::exists(output()));
    workspace.publish();
  }
  EXPECT_EQ(test::read_text(output() / "nodes.bin"), "new");
  EXPECT_FALSE(fs::exists(work()));
}

TEST_F(WorkspaceTest, AFailureLeavesNothing) {
  {
    Workspace workspace(output(), {}, false);
    write_dataset(workspace.dataset_folder(), "new");
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(WorkspaceTest, AnExistingOutputIsRefusedBeforeAnyWork) {
  write_dataset(output(), "old");
  EXPECT_THAT(open_failure(),
              AllOf(HasSubstr("2: "), HasSubstr("site.cairn exists"), HasSubstr("--force")));
  EXPECT_FALSE(fs::exists(work()));
  EXPECT_EQ(test::read_text(output() / "nodes.bin"), "old");
}

TEST_F(WorkspaceTest, ForceKeepsTheOldUntilTheNewIsComplete) {
  write_dataset(output(), "old");
  test::write_text(output() / "run.json", "{}");
  {
    Workspace workspace(output(), {}, true);
    write_dataset(workspace.dataset_folder(), "new");
    EXPECT_EQ(test::read_text(output() / "nodes.bin"), "old");
    workspace.publish();
    EXPECT_EQ(test::read_text(output() / "nodes.bin"), "new");
  }
  EXPECT_FALSE(fs::exists(output() / "run.json"));
  EXPECT_FALSE(fs::exists(work()));
}

TEST_F(WorkspaceTest, ForceThatFailsKeepsTheOld) {
  write_dataset(output(), "old");
  {
    Workspace workspace(output(), {}, true);
    write_dataset(workspace.dataset_folder(), "new");
  }
  EXPECT_EQ(test::read_text(output() / "nodes.bin"), "old");
  EXPECT_FALSE(fs::exists(work()));
}

TEST_F(WorkspaceTest, ForceReplacesDatasetsOnly) {
  test::write_text(output(), "a file");
  EXPECT_THAT(open_failure(true), AllOf(HasSubstr("2: "), HasSubstr("is not a folder")));
  fs::remove(output());
  write_dataset(output(), "old");
  test::write_text(output() / "thesis.txt", "years of work");
  EXPECT_THAT(open_failure(true), AllOf(HasSubstr("2: "), HasSubstr("holds thesis.txt")));
  EXPECT_TRUE(fs::exists(output() / "thesis.txt"));
  fs::remove_all(output());
  fs::create_directory(output());
  EXPECT_THAT(open_failure(true), AllOf(HasSubstr("2: "), HasSubstr("holds no index.bin")));
  test::write_text(output() / "index.bin", "another program's index");
  EXPECT_THAT(open_failure(true), AllOf(HasSubstr("2: "), HasSubstr("that is not Cairn's")));
  EXPECT_TRUE(fs::exists(output() / "index.bin"));
}

TEST_F(WorkspaceTest, AnOutputThatAppearsMeanwhileIsNotOverwritten) {
  Workspace workspace(output(), {}, false);
  write_dataset(workspace.dataset_folder(), "new");
  write_dataset(output(), "another's");
  EXPECT_THAT(failure([&] { workspace.publish(); }), HasSubstr("2: "));
  EXPECT_EQ(test::read_text(output() / "nodes.bin"), "another's");
}

TEST_F(WorkspaceTest, OneBuildAnOutputAtATime) {
  Workspace first(output(), {}, false);
  EXPECT_THAT(open_failure(),
              AllOf(HasSubstr("4: another build of "), HasSubstr("site.cairn.work")));
  EXPECT_TRUE(fs::exists(first.dataset_folder()));
}

TEST_F(WorkspaceTest, FindsWhatAKilledBuildLeft) {
  test::write_text(work() / "held-by-cairn", "");
  test::write_text(work() / "arrays/points", "bulk");
  {
    const Workspace workspace(output(), {}, false);
    EXPECT_EQ(test::read_text(workspace.arrays_folder() / "points"), "bulk");
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(WorkspaceTest, KeepsItsWorkWhenAskedTo) {
  const fs::path scratch = folder_ / "scratch";
  fs::create_directory(scratch);
  for (const bool keep : {true, false}) {
    Workspace workspace(output(), scratch, false);
    if (keep) test::write_text(workspace.arrays_folder() / "points", "bulk");
    EXPECT_EQ(test::read_text(workspace.arrays_folder() / "points"), "bulk");
    if (keep) workspace.keep();
  }
  EXPECT_FALSE(fs::exists(work()));
  EXPECT_TRUE(fs::is_empty(scratch));
}

TEST_F(WorkspaceTest, DiskThatArraysTakeAlreadyIsCountedIn) {
  const fs::path disk_folder = folder_ / "small";
  const test::SmallDisk disk(disk_folder, "1m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting a small tmpfs is not allowed here";
  Workspace workspace(output(), disk_folder, false);
  test::write_text(workspace.arrays_folder() / "points", std::string(700'000, 'x'));
  EXPECT_EQ(failure([&] { workspace.require_free(900'000, 0); }), "");
  EXPECT_THAT(failure([&] { workspace.require_free(1'500'000, 0); }), HasSubstr("4: "));
}

/// As a process that is killed before its destructors run.
void run_and_die(const std::function<void()>& job) {
  const pid_t child = ::fork();
  if (child == 0) {
    job();
    ::_exit(9);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_EQ(WEXITSTATUS(status), 9);
}

TEST_F(WorkspaceTest, AScratchFolderOfAKilledBuildIsRemovedByABuildWithoutOne) {
  const fs::path scratch = folder_ / "scratch";
  fs::create_directory(scratch);
  run_and_die([&] {
    Workspace workspace(output(), scratch, false);
    test::write_text(workspace.arrays_folder() / "points", "bulk");
    ::_exit(9);
  });
  ASSERT_FALSE(fs::is_empty(scratch));
  { Workspace workspace(output(), {}, false); }
  EXPECT_TRUE(fs::is_empty(scratch));
}

TEST_F(WorkspaceTest, ANoteDoesNotMakeAnothersFolderOurs) {
  const fs::path thesis = folder_ / "thesis";
  test::write_text(thesis / "thesis.txt", "years of work");
  test::write_text(work() / "held-by-cairn",
                   R"({"scratch":")" + thesis.string() + R"(","aside":"thesis"})");
  EXPECT_THAT(open_failure(), HasSubstr("4: "));
  EXPECT_EQ(test::read_text(thesis / "thesis.txt"), "years of work");
}

/// The names in a folder in the order in which they go.
class Removals {
 public:
  explicit Removals(const fs::path& folder) : watch_(::inotify_init1(IN_NONBLOCK)) {
    ::inotify_add_watch(watch_, folder.c_str(), IN_DELETE);
  }
  ~Removals() { ::close(watch_); }
  std::vector<std::string> names() const {
    alignas(inotify_event) std::array<char, 65536> bytes;
    const ssize_t size = ::read(watch_, bytes.data(), bytes.size());
    std::vector<std::string> names;
    for (ssize_t at = 0; at < size;) {
      const auto* event = reinterpret_cast<const inotify_event*>(&bytes[static_cast<size_t>(at)]);
      if (event->len > 0) names.emplace_back(event->name);
      at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
    }
    return names;
  }

 private:
  int watch_;
};

TEST_F(WorkspaceTest, TheMarkGoesLastSoThatAKilledCleanUpIsTakenOver) {
  std::optional<Workspace> workspace;
  workspace.emplace(output(), std::nullopt, false);
  for (int i = 0; i < 50; ++i) test::write_text(work() / std::to_string(i), "bulk");
  // Made again, since some file systems list the newest name first.
  const std::string note = test::read_text(work() / "held-by-cairn");
  fs::remove(work() / "held-by-cairn");
  test::write_text(work() / "held-by-cairn", note);
  const Removals removals(work());
  workspace.reset();
  const auto names = removals.names();
  ASSERT_EQ(names.size(), 53U);
  EXPECT_EQ(names.back(), "held-by-cairn");
}

/// A file system that cannot exchange names.
Renames in_two_steps() {
  Renames renames = Renames::of_system();
  renames.exchange = [](const fs::path&, const fs::path&) {
    errno = EINVAL;
    return -1;
  };
  return renames;
}

/// One whose renames fail from the one of this number on.
Renames failing_from(int first_failure) {
  Renames renames = in_two_steps();
  renames.rename = [first_failure, done = 0](const fs::path& from, const fs::path& to) mutable {
    if (++done < first_failure) return ::rename(from.c_str(), to.c_str());
    errno = EIO;
    return -1;
  };
  return renames;
}

TEST_F(WorkspaceTest, ReplacesWhereNamesCannotBeExchanged) {
  write_dataset(output(), "old");
  test::write_text(folder_ / "site.cairn.old/thesis.txt", "the user's");
  {
    Workspace workspace(output(), {}, true);
    write_dataset(workspace.dataset_folder(), "new");
    workspace.publish(in_two_steps());
  }
  EXPECT_EQ(test::read_text(output() / "nodes.bin"), "new");
  EXPECT_EQ(test::read_text(folder_ / "site.cairn.old/thesis.txt"), "the user's");
  fs::remove_all(folder_ / "site.cairn.old");
  fs::remove_all(output());
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(WorkspaceTest, ARenameThatFailsLeavesTheOldInItsPlace) {
  write_dataset(output(), "old");
  {
    Workspace workspace(output(), {}, true);
    write_dataset(workspace.dataset_folder(), "new");
    Renames renames = in_two_steps();
    renames.rename = [done = 0](const fs::path& from, const fs::path& to) mutable {
      if (++done != 2) return ::rename(from.c_str(), to.c_str());
      errno = EIO;
      return -1;
    };
    EXPECT_THAT(failure([&] { workspace.publish(renames); }), HasSubstr("4: cannot replace"));
  }
  EXPECT_EQ(test::read_text(output() / "nodes.bin"), "old");
  EXPECT_FALSE(fs::exists(work()));
}

TEST_F(WorkspaceTest, WhereNothingCanBeMovedBackBothAreKeptAndNamed) {
  write_dataset(output(), "old");
  {
    Workspace workspace(output(), {}, true);
    write_dataset(workspace.dataset_folder(), "new");
    EXPECT_THAT(
        failure([&] { workspace.publish(failing_from(2)); }),
        AllOf(HasSubstr("4: "), HasSubstr("site.cairn.old"), HasSubstr("site.cairn.work/dataset")));
  }
  EXPECT_EQ(test::read_text(folder_ / "site.cairn.old/nodes.bin"), "old");
  EXPECT_EQ(test::read_text(work() / "dataset/nodes.bin"), "new");
}

TEST_F(WorkspaceTest, ADatasetThatAKilledBuildMovedAsideComesBack) {
  write_dataset(output(), "old");
  run_and_die([&] {
    Workspace workspace(output(), {}, true);
    write_dataset(workspace.dataset_folder(), "new");
    Renames renames = in_two_steps();
    renames.rename = [done = 0](const fs::path& from, const fs::path& to) mutable {
      if (++done == 2) ::_exit(9);
      return ::rename(from.c_str(), to.c_str());
    };
    workspace.publish(renames);
  });
  ASSERT_FALSE(fs::exists(output()));
  EXPECT_THAT(open_failure(), AllOf(HasSubstr("2: "), HasSubstr("site.cairn exists")));
  EXPECT_EQ(test::read_text(output() / "nodes.bin"), "old");
  EXPECT_FALSE(fs::exists(work()));
  EXPECT_FALSE(fs::exists(folder_ / "site.cairn.old"));
}

TEST_F(WorkspaceTest, AFolderThatCannotBeSyncedIsNoFailure) {
  const fs::path closed = folder_ / "closed";
  fs::create_directory(closed);
  fs::permissions(folder_.path(), fs::perms(0755));
  fs::permissions(closed, fs::perms(0333));  // entries can be made, not listed
  const bool root = ::geteuid() == 0;
  if (root && ::seteuid(65534) != 0) GTEST_SKIP() << "cannot work as another user";
  const std::string said = failure([&] {
    Workspace workspace(closed / "site.cairn", {}, false);
    write_dataset(workspace.dataset_folder(), "new");
    workspace.publish();
  });
  if (root) ASSERT_EQ(::seteuid(0), 0);
  fs::permissions(closed, fs::perms(0755));
  EXPECT_EQ(said, "");
  EXPECT_EQ(test::read_text(closed / "site.cairn/nodes.bin"), "new");
}

TEST_F(WorkspaceTest, DoesNotEmptyAFolderThatIsNotItsOwn) {
  test::write_text(work() / "thesis.txt", "years of work");
  EXPECT_THAT(open_failure(), AllOf(HasSubstr("4: "), HasSubstr("site.cairn.work")));
  EXPECT_EQ(test::read_text(work() / "thesis.txt"), "years of work");
}

TEST_F(WorkspaceTest, PutsArraysIntoTheScratchFolder) {
  const fs::path scratch = folder_ / "scratch";
  fs::create_directory(scratch);
  {
    Workspace workspace(output(), scratch, false);
    EXPECT_THAT(workspace.arrays_folder().string(), HasSubstr(scratch.string()));
    EXPECT_THAT(workspace.dataset_folder().string(), HasSubstr(work().string()));
  }
  EXPECT_TRUE(fs::is_empty(scratch));
  EXPECT_THAT(failure([&] { Workspace workspace(output(), folder_ / "none", false); }),
              HasSubstr("2: "));
}

TEST_F(WorkspaceTest, NamesThatAreNoPlaceAreRefused) {
  EXPECT_THAT(failure([&] { Workspace workspace(folder_ / "none/site.cairn", {}, false); }),
              AllOf(HasSubstr("2: "), HasSubstr("does not exist")));
  EXPECT_THAT(failure([&] { Workspace workspace(folder_ / "..", {}, false); }), HasSubstr("2: "));
}

TEST_F(WorkspaceTest, TakesATrailingSlash) {
  {
    Workspace workspace(fs::path(output().string() + "/"), {}, false);
    write_dataset(workspace.dataset_folder(), "new");
    workspace.publish();
  }
  EXPECT_TRUE(fs::exists(output() / "index.bin"));
}

TEST_F(WorkspaceTest, FollowsALinkInsteadOfReplacingIt) {
  write_dataset(folder_ / "real.cairn", "old");
  fs::create_directory_symlink(folder_ / "real.cairn", output());
  {
    Workspace workspace(output(), {}, true);
    write_dataset(workspace.dataset_folder(), "new");
    workspace.publish();
  }
  EXPECT_TRUE(fs::is_symlink(output()));
  EXPECT_EQ(test::read_text(folder_ / "real.cairn/nodes.bin"), "new");
}

TEST_F(WorkspaceTest, AsksForDiskSpaceNamingNeededAndFree) {
  Workspace workspace(output(), {}, false);
  EXPECT_EQ(failure([&] { workspace.require_free(1000, 1000); }), "");
  EXPECT_THAT(
      failure([&] { workspace.require_free(std::uint64_t{1} << 60, 24); }),
      AllOf(HasSubstr("4: "), HasSubstr("bytes free"), HasSubstr("expected 1152921504606847000")));
}

TEST_F(WorkspaceTest, ScratchAndOutputAreMeasuredOnTheirOwnDisks) {
  const fs::path scratch = folder_ / "small";
  const test::SmallDisk disk(scratch, "1m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting a small tmpfs is not allowed here";
  Workspace workspace(output(), scratch, false);
  EXPECT_EQ(failure([&] { workspace.require_free(100000, 4 << 20); }), "");
  EXPECT_THAT(failure([&] { workspace.require_free(4 << 20, 100000); }),
              AllOf(HasSubstr("4: "), HasSubstr("small"), HasSubstr("expected 4194304")));
}

}  // namespace
}  // namespace cairn::pipeline
