#include "base/crew.hpp"

#include <chrono>
#include <utility>

#include "base/threads.hpp"

namespace energymargin {
namespace {

// How long a thread looks for a change before it sleeps: longer than most edges of a search take.
constexpr std::chrono::milliseconds patience{2};

}  // namespace

Crew::Crew(int threads) {
  const auto more = static_cast<std::size_t>(with_threads && threads > 1 ? threads - 1 : 0);
  threads_.reserve(more);
  while (threads_.size() < more && start_thread(threads_, [this, thread = threads_.size() + 1] { serve(thread); })) {
  }
}

Crew::~Crew() {
  tell([&] { over_ = true; });
  for (std::thread& thread : threads_) thread.join();
}

void Crew::run(std::size_t count, const Job& job) {
  job_ = &job;
  count_ = count;
  next_ = 0;
  busy_ = threads_.size();
  tell([&] { ++rounds_; });
  work(0);
  wait_until([&] { return busy_ == 0; });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void Crew::serve(std::size_t thread) {
  for (int round = 1;; ++round) {
    wait_until([&] { return rounds_ == round || over_; });
    if (over_) return;
    work(thread);
    tell([&] { --busy_; });
  }
}

void Crew::work(std::size_t thread) {
  for (std::size_t i = next_++; i < count_; i = next_++) {
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
void Crew::wait_until(const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!condition() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  if (condition()) return;
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, condition);
}

template <typename Change>
void Crew::tell(const Change& change) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    change();
  }
  changed_.notify_all();
}

}  // namespace energymargin
