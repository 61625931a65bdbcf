#pragma once
// The streams of one search's seed, one for each of what draws from it.

#include <cstdint>

namespace energymargin::search::streams {

inline constexpr std::uint64_t planner = 0;
inline constexpr std::uint64_t states = 1;
inline constexpr std::uint64_t controls = 2;
inline constexpr std::uint64_t shortening = 3;

}  // namespace energymargin::search::streams
