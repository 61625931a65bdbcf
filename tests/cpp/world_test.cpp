// Rollouts: laws of motion, and purity.

#include "energymargin/world.hpp"

#include <gtest/gtest.h>

TEST(World, Placeholder) {}
