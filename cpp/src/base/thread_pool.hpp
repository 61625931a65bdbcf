#pragma once
// Threads that stay for many batches of jobs.

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "energymargin/limit.hpp"

namespace energymargin {

//! Whether this build starts threads. One that does not works in the calls that wait for results.
inline constexpr bool with_threads = ENERGYMARGIN_THREADS;

//! Adds a thread that runs `work`. False if the system gives none: then the others have to do.
template <typename Work>
bool start_thread(std::vector<std::thread>& threads, Work&& work) {
  try {
    threads.emplace_back(std::forward<Work>(work));
    return true;
  } catch (const std::system_error&) {
    return false;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

//! The caller's thread and some more. Between two batches those yield for a while before they sleep.
class ThreadPool {
 public:
  //! `job(i, thread)`, with thread < size().
  using Job = std::function<void(std::size_t i, std::size_t thread)>;

  //! `threads` threads, the caller's among them; fewer if the system gives no more.
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  std::size_t size() const { return threads_.size() + 1; }

  //! Calls the job for each i < count, once, up to the limit. The first exception ends the rest and is thrown again.
  void run(std::size_t count, const Job& job, const Limit& limit = {});

 private:
  void serve(std::size_t thread);
  void work(std::size_t thread);
  template <typename Condition>
  void wait_until(const Condition& condition);
  template <typename Change>
  void tell(const Change& change);

  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable changed_;

  // The batch.
  const Job* job_ = nullptr;
  const Limit* limit_ = nullptr;
  std::size_t count_ = 0;
  std::atomic<std::size_t> next_{0};
  std::exception_ptr error_;
  std::atomic<std::size_t> busy_{0};  // threads besides the caller's that are not done with it

  std::atomic<int> batches_{0};
  std::atomic<bool> over_{false};
};

}  // namespace energymargin
