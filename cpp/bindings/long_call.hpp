#pragma once
// Long calls from Python: they end after a timeout, when another thread cancels them, or on Ctrl-C.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <system_error>

#include "asking.hpp"
#include "base/thread_pool.hpp"
#include "energymargin/limit.hpp"
#include "given.hpp"

namespace energymargin::binding {

//! What `cancel` is in Python.
struct Cancel {
  std::atomic<bool> is_set{false};
};

using CancelArgument = std::optional<std::shared_ptr<Cancel>>;

//! A call that begins now.
class LongCall {
 public:
  LongCall(const std::optional<double>& timeout, const CancelArgument& cancel) : cancel_(cancel) {
    limit_ = Limit(cancel ? &(*cancel)->is_set : nullptr, timeout);
  }

  //! With its timeout, cancel and progress.
  explicit LongCall(const Keywords& keywords) {
    std::optional<double> timeout;
    keywords("timeout", timeout)("cancel", cancel_)("progress", progress_);
    limit_ = Limit(cancel_ ? &(*cancel_)->is_set : nullptr, timeout);
  }

  const Limit& limit() const { return limit_; }

  //! What a search counts its progress in; null if nobody asks for it.
  std::atomic<int>* counter() { return progress_ ? &count_ : nullptr; }

  //! Runs `search(limit)` on another thread, while this one checks for Ctrl-C and reports the progress. `search` runs
  //! without the GIL and may not touch Python objects. An exception of the callback ends the search. Where there is no
  //! other thread to be had it runs on this one, and both wait until it has ended.
  template <typename Search>
  auto run(const Search& search) {
    // Short at first: each wake-up lets the system move a thread of the search that shares a processor with another
    // one.
    constexpr auto longest = std::chrono::microseconds(20'000);
    auto interval = std::chrono::microseconds(250);
    std::atomic<bool> stop{false};
    const Limit either = limit_.or_when(stop);
    auto result = start([&] { return search(either); });
    const auto runs = [&] {
      const WithoutGil release;
      const bool waits = result.wait_for(interval) == std::future_status::timeout;
      interval = std::min(interval + interval / 8, longest);
      return waits;
    };
    try {
      while (runs()) {
        const Gate gate;
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        Asking::cut_late();
        report();
      }
    } catch (...) {
      stop = true;
      while (runs()) {
        const Gate gate;
        Asking::cut_late();
      }
      throw;
    }
    auto value = [&] {
      const WithoutGil release;
      return result.get();
    }();
    const Gate gate;
    report();
    return value;
  }

  //! A metric of a problem, up to the limit of this call.
  template <typename Result, typename Options>
  Result run(Result (*metric)(const Problem&, const Options&), const Problem& problem, Options& options) {
    return run([&](const Limit& limit) { return options.limit = limit, metric(problem, options); });
  }

  //! The same on this thread: for one that calls Python often, which Ctrl-C ends there.
  template <typename Result, typename Options>
  Result run_here(Result (*metric)(const Problem&, const Options&), const Problem& problem, Options& options) {
    options.limit = limit_;
    Result result = [&] {
      const WithoutGil release;
      const Watchdog watchdog(limit_);
      return metric(problem, options);
    }();
    const Gate gate;
    report();
    return result;
  }

 private:
  template <typename Job>
  static auto start(const Job& job) {
    if constexpr (with_threads) {
      try {
        return std::async(std::launch::async, job);
      } catch (const std::system_error&) {  // the system gives no thread
      }
    }
    return std::async(std::launch::deferred, job);
  }

  void report() {
    const int count = count_;
    if (!progress_ || count == reported_) return;
    reported_ = count;
    (*progress_)(count);
  }

  Limit limit_;
  CancelArgument cancel_;
  std::optional<py::typing::Callable<void(int)>> progress_;
  std::atomic<int> count_{0};
  int reported_ = 0;
};

}  // namespace energymargin::binding
