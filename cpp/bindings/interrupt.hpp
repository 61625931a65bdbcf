#pragma once
// Long calls from Python: they end after a timeout, when another thread cancels them, or on Ctrl-C.

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <system_error>

#include "base/threads.hpp"
#include "convert.hpp"
#include "energymargin/limit.hpp"
#include "keywords.hpp"

namespace energymargin::binding {

//! What `cancel` is in Python.
struct Cancel {
  std::atomic<bool> is_set{false};
};

using TimeoutArgument = std::optional<Number>;
using CancelArgument = std::optional<std::shared_ptr<Cancel>>;
using ProgressArgument = std::optional<py::typing::Callable<void(int)>>;

//! Of a call that begins now; `cancel` has to outlive it.
inline Limit limit_of(const std::optional<double>& timeout, const CancelArgument& cancel) {
  return Limit(cancel ? &(*cancel)->is_set : nullptr, timeout);
}

inline Limit limit_of(const TimeoutArgument& timeout, const CancelArgument& cancel) {
  return limit_of(real("timeout", timeout), cancel);
}

//! Reports to Python how far a search is.
class Progress {
 public:
  explicit Progress(const ProgressArgument& callback) : callback_(callback) {}

  //! For the search to count in; null without a callback.
  std::atomic<int>* counter() { return callback_ ? &count_ : nullptr; }

  //! Calls back if the count has changed.
  void report() {
    const int count = count_;
    if (!callback_ || count == reported_) return;
    reported_ = count;
    (*callback_)(count);
  }

 private:
  ProgressArgument callback_;
  std::atomic<int> count_{0};
  int reported_ = 0;
};

//! Runs `search()` on another thread. No future where the build has no threads, or the system gives none.
template <typename Search>
auto run_on_thread(const Search& search) {
  std::optional<std::future<decltype(search())>> result;
  if constexpr (with_threads) {
    try {
      result = std::async(std::launch::async, search);
    } catch (const std::system_error&) {
      return result;
    }
  }
  return result;
}

//! Runs `search(limit)` on this thread: Ctrl-C and progress wait until it has ended.
template <typename Search>
auto run_uninterrupted(const Limit& limit, const Search& search, Progress* progress) {
  auto result = [&] {
    const py::gil_scoped_release release;
    return search(limit);
  }();
  if (progress) progress->report();
  return result;
}

//! Runs `search(limit)` on another thread, while this one checks for Ctrl-C and reports the progress. `search` runs
//! without the GIL and may not touch Python objects. An exception of the callback ends the search. If there is no other
//! thread to be had, it runs on this one: see run_uninterrupted.
template <typename Search>
auto run_interruptible(const Limit& limit, const Search& search, Progress* progress = nullptr) {
  constexpr auto signal_interval = std::chrono::milliseconds(20);
  std::atomic<bool> stop{false};
  const Limit either = limit.or_when(stop);
  auto thread = run_on_thread([&] { return search(either); });
  if (!thread) return run_uninterrupted(limit, search, progress);
  auto& result = *thread;
  const auto ready = [&] {
    const py::gil_scoped_release release;
    return result.wait_for(signal_interval) == std::future_status::ready;
  };
  try {
    while (!ready()) {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (progress) progress->report();
    }
    if (progress) progress->report();
  } catch (...) {
    stop = true;
    const py::gil_scoped_release release;
    result.wait();
    throw;
  }
  return result.get();
}

//! How a call ends early.
struct LimitCall {
  std::optional<double> timeout{};
  CancelArgument cancel{};

  Limit call_limit() const { return limit_of(timeout, cancel); }
};

//! The same of a call that reports its progress.
struct ProgressCall : LimitCall {
  ProgressArgument progress{};
};

inline auto limit_keywords() {
  return std::tuple{keyword("timeout", &LimitCall::timeout), keyword("cancel", &LimitCall::cancel)};
}

inline auto progress_keywords() {
  return std::tuple_cat(limit_keywords(), std::tuple{keyword("progress", &ProgressCall::progress)});
}

//! Runs `metric(problem, options)` within `call_limit`, and with the call's progress in the options' `counter`.
template <typename Metric, typename Options>
auto run_with_progress(const Metric& metric, const Problem& problem, Options options,
                       std::atomic<int>* Options::* counter, const ProgressCall& call, const Limit& call_limit) {
  Progress progress(call.progress);
  options.*counter = progress.counter();
  return run_interruptible(
      call_limit,
      [&](const Limit& limit) {
        options.limit = limit;
        return metric(problem, options);
      },
      &progress);
}

}  // namespace energymargin::binding
