#pragma once
// Calls of users' functions that are under way, and what ends them where nobody waits for an answer any more.

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <thread>
#include <vector>

#include "base/thread_pool.hpp"
#include "energymargin/limit.hpp"
#include "given.hpp"

namespace energymargin::binding {

//! One call, on this thread. All that it does, it does with the GIL.
class Asking {
 public:
  explicit Asking(const Limit& limit) : limit_(limit), id_(PyThread_get_thread_ident()), thread_(pthread_self()) {
    all().push_back(this);
  }
  Asking(const Asking&) = delete;
  Asking& operator=(const Asking&) = delete;
  ~Asking() {
    all().erase(std::find(all().begin(), all().end(), this));
    if (!was_cut_) return;
    PyThreadState_SetAsyncExc(id_, nullptr);
    if (PyErr_CheckSignals() != 0) PyErr_Clear();
  }

  //! Whether an exception that it raised is that of a cut.
  bool was_cut() const { return was_cut_; }

  //! Interrupts those whose limit is reached. One that goes on is interrupted again by the next call.
  static void cut_late() {
    for (Asking* asking : all()) {
      if (asking->limit_.reached()) asking->cut();
    }
  }

 private:
  static std::vector<Asking*>& all() {
    static std::vector<Asking*> under_way;
    return under_way;
  }

  // A signal also ends a sleep, but only the main thread gets one.
  void cut() {
    was_cut_ = true;
    if (is_main() && signal_raises())
      pthread_kill(thread_, SIGINT);
    else
      PyThreadState_SetAsyncExc(id_, PyExc_KeyboardInterrupt);
  }

  bool is_main() const {
    return py::module_::import("threading").attr("main_thread")().attr("ident").cast<unsigned long>() == id_;
  }

  static bool signal_raises() {
    const auto signal = py::module_::import("signal");
    return signal.attr("getsignal")(SIGINT).is(signal.attr("default_int_handler"));
  }

  const Limit& limit_;
  unsigned long id_;
  pthread_t thread_;
  bool was_cut_ = false;
};

//! Watches over the calls of a computation on this thread, which runs without the GIL.
class Watchdog {
 public:
  explicit Watchdog(const Limit& limit) {
    if (!with_threads) return;
    start_thread(threads_, [this, &limit] {
      constexpr auto interval = std::chrono::milliseconds(20);
      std::unique_lock<std::mutex> lock(mutex_);
      while (!ended_.wait_for(lock, interval, [this] { return is_over_; })) {
        if (!limit.reached()) continue;
        lock.unlock();
        {
          const WithGil acquire;
          Asking::cut_late();
        }
        lock.lock();
      }
    });
  }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
  ~Watchdog() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      is_over_ = true;
    }
    ended_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

 private:
  std::mutex mutex_;
  std::condition_variable ended_;
  bool is_over_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace energymargin::binding
