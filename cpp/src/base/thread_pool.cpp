#include "base/thread_pool.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "energymargin/parallel.hpp"

namespace energymargin {
namespace {

// How long a thread waits for a change before it sleeps: longer than most edges of a search take.
constexpr std::chrono::milliseconds patience{2};

}  // namespace

ThreadPool::ThreadPool(int threads) {
  const auto more = static_cast<std::size_t>(with_threads && threads > 1 ? threads - 1 : 0);
  threads_.reserve(more);
  while (threads_.size() < more && start_thread(threads_, [this, thread = threads_.size() + 1] { serve(thread); })) {
  }
}

ThreadPool::~ThreadPool() {
  tell([&] { over_ = true; });
  for (std::thread& thread : threads_) thread.join();
}

void ThreadPool::run(std::size_t count, const Job& job, const Limit& limit) {
  job_ = &job;
  limit_ = &limit;
  count_ = count;
  next_ = 0;
  busy_ = threads_.size();
  tell([&] { ++batches_; });
  work(0);
  wait_until([&] { return busy_ == 0; });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void ThreadPool::serve(std::size_t thread) {
  for (int batch = 1;; ++batch) {
    wait_until([&] { return batches_ == batch || over_; });
    if (over_) return;
    work(thread);
    tell([&] { --busy_; });
  }
}

void ThreadPool::work(std::size_t thread) {
  for (std::size_t i = next_++; i < count_ && !limit_->reached(); i = next_++) {
    try {
      (*job_)(i, thread);
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!error_) error_ = std::current_exception();
      next_ = count_;
    }
  }
}

template <typename Condition>
void ThreadPool::wait_until(const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!condition() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  if (condition()) return;
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, condition);
}

template <typename Change>
void ThreadPool::tell(const Change& change) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    change();
  }
  changed_.notify_all();
}

void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& job, const Limit& limit) {
  const auto most = static_cast<int>(std::min(count, static_cast<std::size_t>(std::max(threads, 1))));
  ThreadPool(most).run(count, [&](std::size_t i, std::size_t) { job(i); }, limit);
}

}  // namespace energymargin
