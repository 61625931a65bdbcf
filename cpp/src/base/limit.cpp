#include "energymargin/limit.hpp"

#include "base/check.hpp"

namespace energymargin {
namespace {

constexpr double ages = 1e9;  // [s]; a later end is none

}  // namespace

std::optional<std::chrono::steady_clock::time_point> time_after(double seconds) {
  if (seconds > ages) return std::nullopt;
  const auto later = std::chrono::duration<double>(seconds);
  return Limit::Clock::now() + std::chrono::duration_cast<Limit::Clock::duration>(later);
}

Limit::Limit(const std::atomic<bool>* cancel, std::optional<double> timeout) {
  if (cancel != nullptr) cancels_.push_back(cancel);
  if (!timeout) return;
  require_positive("timeout", *timeout);
  end_ = time_after(*timeout);
}

Limit Limit::without_time() const {
  Limit limit = *this;
  limit.end_.reset();
  return limit;
}

Limit Limit::or_when(const std::atomic<bool>& cancel) const {
  Limit either = *this;
  either.cancels_.push_back(&cancel);
  return either;
}

void Limit::require() const {
  if (cancelled()) throw Cancelled();
  if (late()) throw TimedOut();
}

}  // namespace energymargin
