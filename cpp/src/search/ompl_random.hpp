#pragma once
// OMPL's draws; where those take a logarithm or a sine, with the same bits on every processor.

#include <ompl/util/RandomNumbers.h>

#include "base/check.hpp"
#include "base/portable.hpp"

namespace energymargin {

class Draws : public ompl::RNG {
 public:
  using ompl::RNG::RNG;

  //! The polar method (Marsaglia and Bray 1964).
  double gaussian01() {
    if (has_saved_) {
      has_saved_ = false;
      return saved_;
    }
    double x, y, squared;
    do {
      x = 2.0 * uniform01() - 1.0;
      y = 2.0 * uniform01() - 1.0;
      squared = x * x + y * y;
    } while (squared > 1.0 || squared == 0.0);
    const double factor = std::sqrt(-2.0 * portable::log(squared) / squared);
    saved_ = x * factor;
    has_saved_ = true;
    return y * factor;
  }

  double gaussian(double mean, double deviation) { return gaussian01() * deviation + mean; }

  //! Uniform among all turns (Shoemake 1992).
  Quaternion turn() {
    const double share = uniform01();
    const double first = std::sqrt(1.0 - share), second = std::sqrt(share);
    const double one = 2.0 * pi * uniform01(), other = 2.0 * pi * uniform01();
    return {portable::cos(other) * second, portable::sin(one) * first, portable::cos(one) * first,
            portable::sin(other) * second};
  }

 private:
  double saved_ = 0.0;
  bool has_saved_ = false;
};

}  // namespace energymargin
