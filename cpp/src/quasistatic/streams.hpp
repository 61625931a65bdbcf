#pragma once
// The streams of one search's seed, one for each of what draws from it.

#include <cstdint>

namespace energymargin::quasistatic::streams {

inline constexpr std::uint64_t poses = 1;
inline constexpr std::uint64_t rrt_star = 2;

}  // namespace energymargin::quasistatic::streams
