#pragma once
// Threads that leave Python and come back, also while the program ends.

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <thread>

namespace energymargin::binding {

//! What a thread holds while C++ calls Python or goes back to it. Once the program ends, Python unwinds each thread
//! that comes back, through C++ code that cannot be unwound. So the gate closes before that, and who comes then waits.
class Gate {
 public:
  explicit Gate(bool may_hold_gil = true) {
    if (depth++ > 0) return;
    for (++passing; closed && !is_closer(); ++passing) {
      --passing;
      PyThreadState* const state = may_hold_gil && holds_gil() ? PyEval_SaveThread() : nullptr;
      while (closed) std::this_thread::sleep_for(poll);
      if (state) PyEval_RestoreThread(state);
    }
  }
  ~Gate() {
    if (--depth == 0) --passing;
  }
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;

  //! To be called when the program ends, with the GIL: who is in the gate gets through first, unless it takes too long.
  static void close() {
    closer = std::this_thread::get_id();
    closed = true;
    const pybind11::gil_scoped_release release;
    const auto end = std::chrono::steady_clock::now() + longest;
    while (passing > 0 && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(poll);
  }

  //! For a call that the ending program makes after that, as by atexit: its threads have to pass.
  static void open() {
    if (closed && is_closer()) closed = false;
  }

 private:
  static constexpr std::chrono::seconds longest{5};
  static constexpr std::chrono::milliseconds poll{1};

  // Of a thread that Python does not know, Python says late in its end that it does.
  static bool holds_gil() { return PyGILState_GetThisThreadState() && PyGILState_Check(); }
  static bool is_closer() { return std::this_thread::get_id() == closer; }

  static inline std::atomic<int> passing{0};
  static inline std::atomic<bool> closed{false};
  static inline std::thread::id closer{};
  static inline thread_local int depth = 0;
};

//! Lets other threads of Python go on.
class WithoutGil {
 public:
  WithoutGil() {
    Gate::open();
    state_ = PyEval_SaveThread();
  }
  ~WithoutGil() {
    const Gate gate(false);
    PyEval_RestoreThread(state_);
  }
  WithoutGil(const WithoutGil&) = delete;
  WithoutGil& operator=(const WithoutGil&) = delete;

 private:
  PyThreadState* state_ = nullptr;
};

//! Calls Python from any thread.
class WithGil {
 public:
  WithGil() {
    if (!PyGILState_Check()) acquire_.emplace();
  }

 private:
  Gate gate_{};
  std::optional<pybind11::gil_scoped_acquire> acquire_{};
};

}  // namespace energymargin::binding
