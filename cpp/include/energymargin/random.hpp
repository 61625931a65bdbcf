#pragma once
// Seeds: each call has one of 64 bits, from which each problem, tree and sampler gets a stream of its own.

#include <cstdint>

namespace energymargin {

//! The seed of a stream, unrelated to those of neighbouring numbers (SplitMix64).
constexpr std::uint64_t stream(std::uint64_t seed, std::uint64_t number) {
  std::uint64_t mixed = seed + 0x9E3779B97F4A7C15ULL * (number + 1);
  mixed = (mixed ^ (mixed >> 30)) * 0xBF58476D1CE4E5B9ULL;
  mixed = (mixed ^ (mixed >> 27)) * 0x94D049BB133111EBULL;
  return mixed ^ (mixed >> 31);
}

}  // namespace energymargin
