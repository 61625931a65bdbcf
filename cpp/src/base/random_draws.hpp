#pragma once
// Random numbers that are the same with every standard library.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "base/check.hpp"
#include "base/portable.hpp"
#include "energymargin/random.hpp"

namespace energymargin {

//! Draws of one stream, behind given ones.
class Random {
 public:
  //! `leading` are uniform in [0, 1).
  Random(std::uint64_t seed, std::size_t index, std::vector<double> leading = {})
      : engine_(stream(seed, index)), leading_(std::move(leading)) {}

  double uniform() {
    if (next_ < leading_.size()) return leading_[next_++];
    return static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  //! Box and Muller (1958).
  double normal() {
    const double radius = std::sqrt(-2.0 * portable::log(1.0 - uniform()));
    return radius * portable::cos(2.0 * pi * uniform());
  }

  Vector3 within(const Vector3& bounds) {
    Vector3 sample;
    for (int axis = 0; axis < 3; ++axis) sample[axis] = uniform(-bounds[axis], bounds[axis]);
    return sample;
  }

  std::size_t below(std::size_t count) {
    return std::min(count - 1, static_cast<std::size_t>(uniform() * static_cast<double>(count)));
  }

 private:
  std::mt19937_64 engine_;
  std::vector<double> leading_;
  std::size_t next_ = 0;
};

}  // namespace energymargin
