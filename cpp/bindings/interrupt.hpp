#pragma once
// Long calls from Python: they end at a time, when another thread says so, or on Ctrl-C.

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <system_error>

#include "base/threads.hpp"
#include "convert.hpp"
#include "energymargin/limit.hpp"

namespace energymargin::binding {

//! What `cancel` is in Python.
struct Cancel {
  std::atomic<bool> is_set{false};
};

using TimeoutArgument = std::optional<Number>;
using CancelArgument = std::optional<std::shared_ptr<Cancel>>;

//! Of a call that begins now; `cancel` has to outlive it.
inline Limit limit_of(const TimeoutArgument& timeout, const CancelArgument& cancel) {
  return Limit(cancel ? &(*cancel)->is_set : nullptr, real("timeout", timeout));
}

using ProgressArgument = std::optional<py::typing::Callable<void(int)>>;

//! Tells Python how many nodes a search has made.
class Progress {
 public:
  explicit Progress(const ProgressArgument& call) : call_(call) {}

  //! For the search to count in; null if nobody wants to know.
  std::atomic<int>* made() { return call_ ? &made_ : nullptr; }

  void tell() {
    const int made = made_;
    if (!call_ || made == told_) return;
    told_ = made;
    (*call_)(made);
  }

 private:
  ProgressArgument call_;
  std::atomic<int> made_{0};
  int told_ = 0;
};

//! Runs `search()` on a thread of its own. Without a future where the build has no threads, or the system gives none.
template <typename Search>
auto started(const Search& search) {
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
auto uninterrupted(const Limit& limit, const Search& search, Progress* progress) {
  auto result = [&] {
    const py::gil_scoped_release release;
    return search(limit);
  }();
  if (progress) progress->tell();
  return result;
}

//! Runs `search(limit)` on a thread of its own while this one looks for Ctrl-C and tells of the progress; without one
//! on this thread. Without the GIL: `search` may not touch Python objects. What `progress` raises ends the search.
template <typename Search>
auto interruptible(const Limit& limit, const Search& search, Progress* progress = nullptr) {
  constexpr auto signal_interval = std::chrono::milliseconds(20);
  std::atomic<bool> stop{false};
  const Limit either = limit.or_when(stop);
  auto thread = started([&] { return search(either); });
  if (!thread) return uninterrupted(limit, search, progress);
  auto& result = *thread;
  const auto ready = [&] {
    const py::gil_scoped_release release;
    return result.wait_for(signal_interval) == std::future_status::ready;
  };
  try {
    while (!ready()) {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (progress) progress->tell();
    }
    if (progress) progress->tell();
  } catch (...) {
    stop = true;
    const py::gil_scoped_release release;
    result.wait();
    throw;
  }
  return result.get();
}

}  // namespace energymargin::binding
