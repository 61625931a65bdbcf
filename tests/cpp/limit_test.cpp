// When long computations end.

#include "energymargin/limit.hpp"

#include <gtest/gtest.h>

#include "energymargin/world.hpp"
#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

TEST(Limit, WithoutFlagAndTimeItIsNeverReached) {
  EXPECT_FALSE(Limit().reached());
  EXPECT_FALSE(Limit(nullptr).reached());
  EXPECT_FALSE(Limit(nullptr, 1e300).reached());
}

TEST(Limit, IsReachedOnceAnyOfItsFlagsIsSetOrItsTimeIsOver) {
  std::atomic<bool> one{false}, other{false};
  const Limit limit = Limit(&one).or_when(other);
  EXPECT_FALSE(limit.reached());
  other = true;
  EXPECT_TRUE(limit.reached());
  EXPECT_FALSE(Limit(&one).reached());
  EXPECT_THROW(limit.require(), Cancelled);
  const Limit soon(nullptr, 1e-9);
  while (!soon.reached()) {
  }
  EXPECT_FALSE(soon.cancelled());
  EXPECT_THROW(soon.require(), TimedOut);
}

TEST(Limit, TimeoutThatCannotBeIsRejectedByValue) {
  for (const double timeout : {0.0, -1.0, nan, infinity}) {
    EXPECT_TRUE(rejects([&] { Limit(nullptr, timeout); }, {"timeout is", "above 0"}));
  }
}

TEST(Limit, EndsARolloutAndASimulationWithoutAResult) {
  const std::atomic<bool> cancel{true};
  World world(push_scene());
  const State start = pack(world.scene());
  EXPECT_THROW(world.rollout(start, {Wrench{}}, 1000.0, false, Limit(&cancel)), Cancelled);
  EXPECT_THROW(world.rollout(start, {Wrench{}}, 4000.0, false, Limit(nullptr, 1e-3)), TimedOut);
  EXPECT_THROW(world.simulate(start, {}, most_steps, {most_steps}, Limit(&cancel)), Cancelled);
  EXPECT_THROW(world.simulate(start, {}, most_steps, {most_steps}, Limit(nullptr, 1e-3)), TimedOut);
}

TEST(Limit, ThatIsNotReachedChangesNoBit) {
  World world(push_scene());
  const State start = pack(world.scene());
  const std::atomic<bool> cancel{false};
  const Limit far(&cancel, 1e6);
  const Wrench wrench{{0.3, 0.2, 0.0}, {0.0, 0.0, 0.02}};
  EXPECT_TRUE(
      same_bits(world.rollout(start, {wrench}, 0.5).state, world.rollout(start, {wrench}, 0.5, false, far).state));
  const States free = world.simulate(start, {}, 100, {100}).front().state.transpose();
  EXPECT_TRUE(same_bits(free, States(world.simulate(start, {}, 100, {100}, far).front().state.transpose())));
}

}  // namespace
}  // namespace energymargin
