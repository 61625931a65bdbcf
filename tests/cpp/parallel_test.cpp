// Jobs on threads.

#include "energymargin/parallel.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include "base/thread_pool.hpp"
#include "expect.hpp"
#include "few_threads.hpp"

namespace energymargin {
namespace {

TEST(Parallel, EachJobRunsOnceForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 4, 100}) {
    std::vector<std::atomic<int>> runs(57);
    parallel_for(runs.size(), threads, [&](std::size_t i) { ++runs[i]; });
    for (const std::atomic<int>& count : runs) EXPECT_EQ(count, 1);
  }
}

TEST(Parallel, NoMoreThreadsRunAtOnceThanAskedFor) {
  std::atomic<int> running{0};
  std::atomic<int> most{0};
  parallel_for(200, 3, [&](std::size_t) {
    const int now = ++running;
    int before = most;
    while (now > before && !most.compare_exchange_weak(before, now)) {
    }
    std::this_thread::yield();
    --running;
  });
  EXPECT_LE(most, 3);
}

TEST(Parallel, OneThreadIsTheCallersAndKeepsTheOrder) {
  std::vector<std::size_t> order;
  parallel_for(5, 1, [&, caller = std::this_thread::get_id()](std::size_t i) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    order.push_back(i);
  });
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 3, 4}));
}

TEST(Parallel, FirstErrorEndsTheRestAndIsThrownAgain) {
  std::atomic<int> runs{0};
  EXPECT_TRUE(rejects(
      [&] {
        parallel_for(1000, 1, [&](std::size_t i) {
          ++runs;
          if (i == 3) throw std::invalid_argument("job 3 failed");
        });
      },
      {"job 3 failed"}));
  EXPECT_EQ(runs, 4);
  EXPECT_THROW(parallel_for(100, 4, [](std::size_t) { throw std::runtime_error("each"); }), std::runtime_error);
}

TEST(Parallel, NoJobBeginsOnceTheLimitIsReached) {
  std::atomic<bool> cancel{false};
  std::atomic<int> runs{0};
  const auto job = [&](std::size_t i) {
    ++runs;
    if (i == 3) cancel = true;
  };
  parallel_for(1000, 1, job, Limit(&cancel));
  EXPECT_EQ(runs, 4);
}

// Whether each of many jobs for eight threads runs once, on so many threads: the jobs wait until all are there.
bool each_job_runs_once_on(std::size_t threads) {
  std::mutex mutex;
  std::condition_variable came;
  std::set<std::thread::id> there;
  std::vector<int> runs(50);
  parallel_for(runs.size(), 8, [&](std::size_t i) {
    std::unique_lock<std::mutex> lock(mutex);
    ++runs[i];
    there.insert(std::this_thread::get_id());
    came.notify_all();
    came.wait_for(lock, std::chrono::seconds(60), [&] { return there.size() == threads; });
  });
  return there.size() == threads && runs == std::vector<int>(runs.size(), 1);
}

TEST(Parallel, JobsRunOnTheThreadsThatThereAreIfTheSystemGivesNoMore) {
  if (!with_threads || !can_bound_memory) GTEST_SKIP() << "built without threads, or with a sanitizer";
  for (const int helpers : {0, 2}) {
    const auto with_few_threads = [helpers] {
      leave_room_for_threads(helpers);
      std::exit(each_job_runs_once_on(static_cast<std::size_t>(helpers) + 1) ? 0 : 1);
    };
    EXPECT_EXIT(with_few_threads(), testing::ExitedWithCode(0), "") << helpers << " threads besides the caller's";
  }
}

TEST(Parallel, NoJobsIsNoWork) {
  parallel_for(0, 4, [](std::size_t) { FAIL(); });
}

}  // namespace
}  // namespace energymargin
