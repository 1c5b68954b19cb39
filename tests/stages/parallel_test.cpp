#include "stages/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

namespace cairn::stages {
namespace {

TEST(RunInArena, SevenWorkersReallyRunSideBySide) {
  std::atomic<int> arrived{0};
  std::atomic<bool> all_met{true};
  run_in_arena(7, [&] {
    for_each_piece(7, [&](std::uint64_t) {
      ++arrived;
      // Only seven threads at a time let all pieces meet here.
      const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
      while (arrived < 7 && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
      if (arrived < 7) all_met = false;
    });
  });
  EXPECT_TRUE(all_met);
}

TEST(RunInArena, OneWorkerRunsOnePieceAtATime) {
  std::atomic<int> inside{0};
  std::atomic<bool> overlapped{false};
  run_in_arena(1, [&] {
    for_each_piece(50, [&](std::uint64_t) {
      if (++inside > 1) overlapped = true;
      std::this_thread::yield();
      --inside;
    });
  });
  EXPECT_FALSE(overlapped);
}

TEST(ForEachPiece, RethrowsAnError) {
  EXPECT_THROW(for_each_piece(100,
                              [](std::uint64_t i) {
                                if (i == 37) throw std::runtime_error("piece");
                              }),
               std::runtime_error);
}

TEST(ForEachPiece, NoCodeRunsBehindALoopThatAFailureElsewhereCutShort) {
  constexpr std::uint64_t kPieces = 200;
  std::atomic<int> inside{0};
  std::atomic<bool> failed{false}, cut_short{false};
  const auto wait_until = [](const auto& done) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!done() && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  };
  const auto outer = [&](std::uint64_t i) {
    if (i == 0) {
      wait_until([&] { return inside > 0; });
      failed = true;
      throw std::runtime_error("the first error");
    }
    std::atomic<std::uint64_t> done{0};
    for_each_piece(kPieces, [&](std::uint64_t) {
      ++inside;
      wait_until([&] { return failed.load(); });
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      ++done;
    });
    if (done != kPieces) cut_short = true;
  };
  run_in_arena(4, [&] {
    try {
      for_each_piece(4, outer);
      ADD_FAILURE() << "the error was lost";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "the first error");
    }
  });
  EXPECT_FALSE(cut_short);
}

}  // namespace
}  // namespace cairn::stages
