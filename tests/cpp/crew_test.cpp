// Threads that stay for many rounds of jobs.

#include "base/crew.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "base/threads.hpp"

namespace energymargin {
namespace {

TEST(Crew, EachJobOfEachOfManyRoundsRunsOnceAndBeforeTheNextRound) {
  for (const int threads : {1, 2, 4}) {
    Crew crew(threads);
    std::vector<int> runs(7);
    for (int round = 1; round <= 500; ++round) {
      crew.run(runs.size(), [&](std::size_t i, std::size_t) { ++runs[i]; });
      ASSERT_EQ(runs, std::vector<int>(runs.size(), round)) << threads << " threads";
    }
  }
}

TEST(Crew, EachThreadHasANumberOfItsOwnAndTheCallersIsZero) {
  Crew crew(3);
  EXPECT_EQ(crew.size(), with_threads ? 3u : 1u);
  std::vector<std::atomic<int>> inside(crew.size());
  crew.run(500, [&, caller = std::this_thread::get_id()](std::size_t, std::size_t thread) {
    EXPECT_EQ(thread == 0, std::this_thread::get_id() == caller);
    EXPECT_EQ(++inside[thread], 1);
    std::this_thread::yield();
    --inside[thread];
  });
}

TEST(Crew, ARoundAfterAllHaveFallenAsleepWakesThem) {
  Crew crew(2);
  for (int round = 0; round < 3; ++round) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    std::atomic<int> runs{0};
    crew.run(10, [&](std::size_t, std::size_t) { ++runs; });
    EXPECT_EQ(runs, 10);
  }
}

TEST(Crew, CallerSleepsUntilALongJobOfAnotherThreadIsDone) {
  Crew crew(2);
  std::atomic<int> runs{0};
  crew.run(2, [&](std::size_t i, std::size_t) {
    if (i == 1) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ++runs;
  });
  EXPECT_EQ(runs, 2);
}

TEST(Crew, FirstErrorOfARoundIsThrownAgainAndTheNextRoundIsWhole) {
  for (const int threads : {1, 3}) {
    Crew crew(threads);
    EXPECT_THROW(crew.run(100, [](std::size_t, std::size_t) { throw std::runtime_error("each"); }), std::runtime_error);
    std::atomic<int> runs{0};
    crew.run(100, [&](std::size_t, std::size_t) { ++runs; });
    EXPECT_EQ(runs, 100);
  }
}

TEST(Crew, RoundWithoutJobsIsNoWork) {
  Crew crew(3);
  crew.run(0, [](std::size_t, std::size_t) { FAIL(); });
}

}  // namespace
}  // namespace energymargin
