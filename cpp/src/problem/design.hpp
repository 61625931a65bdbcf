#pragma once
// Where the first random numbers of each rollout come from, so that rollouts spread over them evenly.

#include <boost/random/sobol.hpp>
#include <cstdint>
#include <vector>

#include "energymargin/random.hpp"

namespace energymargin::design {

//! Independent groups of a design, whose spread tells its variance.
inline constexpr std::uint64_t groups = 8;

//! The group of rollout number `index`.
inline std::uint64_t group_of(std::uint64_t index) { return index % groups; }

//! The first numbers, in [0, 1), of rollout number `index`: of a Sobol sequence for each group, with a random digital
//! shift (L'Ecuyer and Lemieux, Recent advances in randomized quasi-Monte Carlo methods, 2002). Each is even by itself.
inline std::vector<double> sobol_point(std::uint64_t seed, std::uint64_t index) {
  constexpr std::size_t dimensions = 21;  // three pushes of an object, and how long they last
  boost::random::sobol sequence(dimensions);
  sequence.discard(index / groups * dimensions);
  std::vector<double> point;
  for (std::size_t i = 0; i < dimensions; ++i) {
    const std::uint64_t shift = stream(stream(seed, ~group_of(index)), i);
    point.push_back(static_cast<double>((sequence() ^ shift) >> 11) * 0x1p-53);
  }
  return point;
}

}  // namespace energymargin::design
