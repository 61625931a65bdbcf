#include "search/quiet.hpp"

#include <ompl/util/Console.h>

#include <mutex>

namespace energymargin::search {
namespace {

class Quiet {
 public:
  Quiet() : before_(ompl::msg::getLogLevel()) { ompl::msg::setLogLevel(ompl::msg::LOG_ERROR); }
  ~Quiet() { ompl::msg::setLogLevel(before_); }

 private:
  ompl::msg::LogLevel before_;
};

std::mutex mutex;
int searches = 0;
std::unique_ptr<Quiet> quiet;

void leave(const void*) {
  const std::lock_guard<std::mutex> lock(mutex);
  if (--searches == 0) quiet.reset();
}

}  // namespace

std::shared_ptr<const void> quiet_ompl() {
  const std::lock_guard<std::mutex> lock(mutex);
  if (searches++ == 0) quiet = std::make_unique<Quiet>();
  return {quiet.get(), leave};
}

}  // namespace energymargin::search
