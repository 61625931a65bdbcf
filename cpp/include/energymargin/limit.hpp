#pragma once
// When a long computation has to end: at a time, or when another thread says so.

#include <atomic>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <vector>

namespace energymargin {

//! A computation that has no partial result was cancelled.
class Cancelled : public std::runtime_error {
 public:
  Cancelled() : std::runtime_error("cancelled before it was done") {}
};

//! A computation that has no partial result took longer than it may.
class TimedOut : public std::runtime_error {
 public:
  TimedOut() : std::runtime_error("the time was over before it was done") {}
};

//! The time so many seconds from now; none if that is ages away, or never comes.
std::optional<std::chrono::steady_clock::time_point> time_after(double seconds);

//! Never reached, unless made with a flag or a time; once reached it stays so.
class Limit {
 public:
  using Clock = std::chrono::steady_clock;

  Limit() = default;

  //! Reached once `cancel`, which outlives this, is true (null: never), and `timeout` from now on [s], finite, above 0.
  explicit Limit(const std::atomic<bool>* cancel, std::optional<double> timeout = std::nullopt);

  //! This one, or another flag.
  Limit or_when(const std::atomic<bool>& cancel) const;

  //! The flags alone.
  Limit without_time() const;

  bool reached() const { return cancelled() || late(); }

  bool cancelled() const {
    for (const std::atomic<bool>* cancel : cancels_) {
      if (cancel->load(std::memory_order_relaxed)) return true;
    }
    return false;
  }

  //! Throws Cancelled or TimedOut if it is reached.
  void require() const;

 private:
  bool late() const { return end_ && Clock::now() >= *end_; }

  std::vector<const std::atomic<bool>*> cancels_;
  std::optional<Clock::time_point> end_;
};

}  // namespace energymargin
