#include "energymargin/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "base/threads.hpp"

namespace energymargin {

void parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& job, const Limit& limit) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr error;
  std::mutex error_mutex;
  const auto work = [&] {
    for (std::size_t i = next++; i < count && !limit.reached(); i = next++) {
      try {
        job(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(error_mutex);
        if (!error) error = std::current_exception();
        next = count;
      }
    }
  };
  std::vector<std::thread> pool;
  const std::size_t helpers = std::min(count, static_cast<std::size_t>(with_threads ? std::max(threads, 1) : 1));
  while (pool.size() + 1 < helpers && start_thread(pool, work)) {
  }
  work();
  for (std::thread& thread : pool) thread.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace energymargin
