// The worker processes of the LAZ reader: killed, abandoned, many at a time, missing.
#include <gtest/gtest.h>

#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "formats/error.h"
#include "formats/scans/laz/worker.h"
#include "tests/support/laz_bytes.h"
#include "tests/support/scan_points.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {
namespace {

const std::filesystem::path kMegaplot = CAIRN_SHARED_DATA "/laz/Megaplot.laz";

/// Children of this process, ended ones not yet waited for included.
std::vector<pid_t> children() {
  std::vector<pid_t> found;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream status(entry.path() / "stat");
    std::string text;
    std::getline(status, text);
    const std::size_t behind_name = text.rfind(')');
    if (behind_name == std::string::npos) continue;
    // ") S parent ..."
    if (std::stoi(text.substr(behind_name + 4)) == ::getpid())
      found.push_back(std::stoi(entry.path().filename()));
  }
  return found;
}

struct Enough {};

TEST(LazWorkers, AKilledWorkerIsAnErrorThatNamesFileAndChunk) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto reader = test::open_scan(kMegaplot);
  bool killed = false;
  try {
    reader->read(0, [&](const PointBlock&) {
      for (const pid_t child : children()) ::kill(child, SIGKILL);
      killed = true;
    });
    ADD_FAILURE() << "nobody missed the worker";
  } catch (const Error& error) {
    EXPECT_TRUE(killed);
    EXPECT_EQ(error.kind(), ErrorKind::kSystem) << "the file is not at fault";
    const std::string text = error.what();
    EXPECT_NE(text.find("LAZ chunk 1 of 2 cannot be decoded"), std::string::npos) << text;
    EXPECT_NE(text.find("Megaplot.laz"), std::string::npos) << text;
  }
  std::uint64_t points = 0;
  reader->read(0, [&](const PointBlock& block) { points += block.count; });
  EXPECT_EQ(points, reader->stretch_capacity(0));
}

// It has no memory for such a chunk and ends while the chunk is still sent.
TEST(LazWorkers, WhatAWorkerSaysBeforeItEndsIsToldWhateverFailsFirst) {
  constexpr std::uint32_t kBytes = 0xfff00000U;
  const test::TemporaryFolder folder;
  const auto path = folder.write("sparse", "");
  std::filesystem::resize_file(path, kBytes);
  LazWorker worker;
  try {
    worker.send(
        RandomAccessFile(path),
        {.offset = 0, .size_bytes = kBytes, .points = 1, .record_bytes = 20, .point_format = 0});
    ADD_FAILURE() << "nobody missed the worker";
  } catch (const LazWorkerFailure& failure) {
    EXPECT_FALSE(failure.was_killed());
    EXPECT_STRNE(failure.what(), "the decoder has ended");
  }
}

TEST(LazWorkers, AWorkerLeftInTheMiddleIsNotUsedAgain) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto reader = test::open_scan(kMegaplot);
  EXPECT_THROW(reader->read(0, [](const PointBlock&) { throw Enough{}; }), Enough);
  EXPECT_EQ(children(), std::vector<pid_t>{});
  std::uint64_t points = 0;
  reader->read(0, [&](const PointBlock& block) { points += block.count; });
  EXPECT_EQ(points, reader->stretch_capacity(0));
}

TEST(LazWorkers, EndWithTheLastReader) {
  CAIRN_NEEDS_SHARED_DATA();
  {
    const auto one = test::open_scan(kMegaplot);
    const auto other = test::open_scan(kMegaplot);
    one->read(0, [](const PointBlock&) {});
    other->read(0, [](const PointBlock&) {});
    EXPECT_EQ(children().size(), 1u) << "the first reader's worker is used again";
  }
  EXPECT_EQ(children(), std::vector<pid_t>{});
}

TEST(LazWorkers, StandInAProcessGroupOfTheirOwn) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto reader = test::open_scan(kMegaplot);
  reader->read(0, [](const PointBlock&) {});
  const auto workers = children();
  ASSERT_EQ(workers.size(), 1u);
  EXPECT_NE(::getpgid(workers[0]), ::getpgrp()) << "Ctrl-C would reach it";
  // Nothing of this process but the socket, as input and output.
  std::vector<std::string> open;
  for (const auto& entry :
       std::filesystem::directory_iterator("/proc/" + std::to_string(workers[0]) + "/fd")) {
    const std::string target = std::filesystem::read_symlink(entry.path());
    if (target.starts_with("/")) open.push_back(target);
  }
  std::erase(open, "/dev/null");
  EXPECT_EQ(open, std::vector<std::string>{});
}

TEST(LazWorkers, ManyThreadsReadWhatOneReads) {
  CAIRN_NEEDS_SHARED_DATA();
  const std::filesystem::path path = CAIRN_SHARED_DATA "/copc/1.2-with-color.copc.laz";
  const auto expected = test::read_points(path);
  const auto workers = LazWorkers::shared();
  std::vector<std::vector<std::string>> found(4);
  {
    std::vector<std::jthread> threads;
    for (auto& records : found)
      threads.emplace_back([&] {
        const auto scan = test::read_points(path);
        records = scan.records(scan.names());
      });
  }
  for (const auto& records : found) EXPECT_EQ(records, expected.records(expected.names()));
}

TEST(LazWorkers, TheirMemoryIsCounted) {
  CAIRN_NEEDS_SHARED_DATA();
  const auto reader = test::open_scan(kMegaplot);
  reader->read(0, [](const PointBlock&) {});
  std::uint64_t resident = 0;
  for (const pid_t child : children()) {
    std::ifstream status("/proc/" + std::to_string(child) + "/statm");
    std::uint64_t pages = 0;
    status >> pages >> pages;
    resident += pages * 4096;
  }
  const std::uint64_t peak = laz_workers_peak_bytes();
  EXPECT_GT(peak, std::uint64_t{20} << 20) << "no Node.js runs in less";
  EXPECT_GE(peak, resident);
  EXPECT_LE(resident, reader->read_bytes());
}

TEST(LazWorkers, WithoutNodeTheErrorSaysWhatToInstall) {
  test::LazBytes laz;
  laz.las.records = {std::string(20, 'x')};
  const test::TemporaryFolder folder;
  const auto reader = test::open_scan(folder.write("scan.laz", laz.build()));
  const std::string path = ::getenv("PATH");
  ::setenv("PATH", folder.path().c_str(), 1);
  try {
    reader->read(0, [](const PointBlock&) {});
    ADD_FAILURE() << "read without Node.js";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kSystem);
    EXPECT_NE(std::string(error.what()).find("nodejs"), std::string::npos) << error.what();
  }
  ::setenv("PATH", path.c_str(), 1);
}

}  // namespace
}  // namespace cairn::formats
