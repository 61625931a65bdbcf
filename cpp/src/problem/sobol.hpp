#pragma once
// Where the random numbers of each rollout come from, so that rollouts spread over them evenly.

#include <boost/random/sobol.hpp>
#include <cstdint>
#include <vector>

#include "energymargin/random.hpp"

namespace energymargin::design {

//! The first numbers of each rollout: points of a Sobol sequence with a nested uniform scramble (Owen, Randomly
//! permuted (t,m,s)-nets and (t,s)-sequences, 1995).
class Sobol {
 public:
  explicit Sobol(std::uint64_t seed) : seed_(seed), sequence_(dimensions) {}

  //! The numbers, in [0, 1), of rollout number `index`.
  std::vector<double> point(std::uint64_t index) {
    if (index > 0) sequence_.seed(index - 1);  // Boost begins behind the origin
    std::vector<double> point;
    for (std::size_t i = 0; i < dimensions; ++i) {
      const std::uint64_t even = index > 0 ? sequence_() : 0;
      point.push_back(static_cast<double>(scrambled(even, stream(seed_, i), index) >> 11) * 0x1p-53);
    }
    return point;
  }

 private:
  static constexpr std::size_t dimensions = 256;  // 36 pushes of an object, four of ten objects
  static constexpr int levels = 20;

  // Each leading bit is flipped or not as those before it say, and the others are random.
  static std::uint64_t scrambled(std::uint64_t even, std::uint64_t key, std::uint64_t index) {
    std::uint64_t flips = 0;
    for (int level = 0; level < levels; ++level) {
      const std::uint64_t before = level > 0 ? even >> (64 - level) : 0;
      flips = flips << 1 | (stream(key, (std::uint64_t{1} << level) + before) & 1);
    }
    const std::uint64_t leading = (even >> (64 - levels)) ^ flips;
    return leading << (64 - levels) | stream(~key, index) >> levels;
  }

  std::uint64_t seed_;
  boost::random::sobol sequence_;
};

//! How many neighbouring rollouts of `count` make a block, of which there are 16 to 31: a power of two. Each is spread
//! evenly by itself, so that blocks tell the variance of their mean, and mostly rather more of it. 0: too few.
inline std::uint64_t block_of(std::uint64_t count) {
  std::uint64_t block = count < 16 ? 0 : 1;
  while (block > 0 && 32 * block <= count) block *= 2;
  return block;
}

}  // namespace energymargin::design
