// Threads that stay for many batches of jobs.

#include "base/thread_pool.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace energymargin {
namespace {

TEST(ThreadPool, EachJobOfEachOfManyRoundsRunsOnceAndBeforeTheNextRound) {
  for (const int threads : {1, 2, 4}) {
    ThreadPool pool(threads);
    std::vector<int> runs(7);
    for (int round = 1; round <= 500; ++round) {
      pool.run(runs.size(), [&](std::size_t i, std::size_t) { ++runs[i]; });
      ASSERT_EQ(runs, std::vector<int>(runs.size(), round)) << threads << " threads";
    }
  }
}

TEST(ThreadPool, EachThreadHasANumberOfItsOwnAndTheCallersIsZero) {
  ThreadPool pool(3);
  EXPECT_EQ(pool.size(), with_threads ? 3u : 1u);
  std::vector<std::atomic<int>> inside(pool.size());
  pool.run(500, [&, caller = std::this_thread::get_id()](std::size_t, std::size_t thread) {
    EXPECT_EQ(thread == 0, std::this_thread::get_id() == caller);
    EXPECT_EQ(++inside[thread], 1);
    std::this_thread::yield();
    --inside[thread];
  });
}

TEST(ThreadPool, ARoundAfterAllHaveFallenAsleepWakesThem) {
  ThreadPool pool(2);
  for (int round = 0; round < 3; ++round) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    std::atomic<int> runs{0};
    pool.run(10, [&](std::size_t, std::size_t) { ++runs; });
    EXPECT_EQ(runs, 10);
  }
}

TEST(ThreadPool, CallerSleepsUntilALongJobOfAnotherThreadIsDone) {
  ThreadPool pool(2);
  std::atomic<int> runs{0};
  pool.run(2, [&](std::size_t i, std::size_t) {
    if (i == 1) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ++runs;
  });
  EXPECT_EQ(runs, 2);
}

TEST(ThreadPool, FirstErrorOfARoundIsThrownAgainAndTheNextRoundIsWhole) {
  for (const int threads : {1, 3}) {
    ThreadPool pool(threads);
    EXPECT_THROW(pool.run(100, [](std::size_t, std::size_t) { throw std::runtime_error("each"); }), std::runtime_error);
    std::atomic<int> runs{0};
    pool.run(100, [&](std::size_t, std::size_t) { ++runs; });
    EXPECT_EQ(runs, 100);
  }
}

TEST(ThreadPool, RoundWithoutJobsIsNoWork) {
  ThreadPool pool(3);
  pool.run(0, [](std::size_t, std::size_t) { FAIL(); });
}

}  // namespace
}  // namespace energymargin
