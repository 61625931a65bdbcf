#pragma once
// How much memory a computation needs at most, as Linux counts it.

#include <malloc.h>

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

namespace energymargin {

class PeakMemory {
 public:
  //! Counts from here on.
  PeakMemory() {
    malloc_trim(0);
    std::ofstream("/proc/self/clear_refs") << 5;  // sets the peak to what is resident now
    start_ = read("VmRSS:");
  }

  //! Peak resident memory since then, above that of the start [bytes].
  double grown() const { return read("VmHWM:") - start_; }

 private:
  static double read(const std::string& name) {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
      std::istringstream words(line);
      std::string word;
      double kilobytes = 0.0;
      if (words >> word >> kilobytes && word == name) return 1024.0 * kilobytes;
    }
    throw std::runtime_error("/proc/self/status has no " + name);
  }

  double start_ = 0.0;
};

}  // namespace energymargin
