// Streams of a seed.

#include "energymargin/random.hpp"

#include <gtest/gtest.h>

#include <set>

namespace energymargin {
namespace {

TEST(Random, StreamsAreTheOutputsOfSplitMix64) {
  EXPECT_EQ(stream(0, 0), 0xE220A8397B1DCDAFULL);
  EXPECT_EQ(stream(0, 1), 0x6E789E6AA1B965F4ULL);
  EXPECT_EQ(stream(0, 2), 0x06C45D188009454FULL);
}

TEST(Random, NeighbouringSeedsAndStreamsShareNoNumberEvenInTheirLowerHalf) {
  // OMPL's generators take 32 bits.
  std::set<std::uint32_t> seen;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    for (std::uint64_t number = 0; number < 50; ++number) seen.insert(static_cast<std::uint32_t>(stream(seed, number)));
  }
  EXPECT_EQ(seen.size(), 2500u);
}

}  // namespace
}  // namespace energymargin
