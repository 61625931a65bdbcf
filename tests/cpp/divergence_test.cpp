// Rollouts beyond what numbers can hold: they end, with a state or with an error, whatever is asked of them.

#include <gtest/gtest.h>

#include <functional>

#include "random_mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

constexpr double magnitudes[] = {1e3, 1e6, 1e9, 1e12, 1e30, 1e77, 1e100, 1e150, 1e154, 1e160, 1e200, 1e300, 1.7e308};

// Two bodies that touch, a wall in reach of both and, on a post, a link of the same shape.
Scene crowd(const Shape& shape, const Shape& other) {
  Scene scene;
  scene.add_body(fixed("floor", Plane{}));
  scene.add_body(fixed("wall", other, {0.12, 0.0, 0.1}));
  scene.add_body(body("object", shape, 1.0, {0.0, 0.0, 0.1}, Role::object));
  scene.add_body(body("neighbour", other, 1.0, {0.0, 0.101, 0.1}));
  scene.add_body(fixed("post", Box{{0.05, 0.05, 0.05}}, {0.0, -0.3, 0.3}));
  scene.add_body(body("link", other, 0.5, Vector3::Zero()));
  scene.add_joint(
      joint("hinge", JointType::revolute, "post", "link", Vector3::UnitX(), Vector3::Zero(), {0.0, -0.2, 0.15}));
  return scene;
}

class Divergence : public testing::Test {
 protected:
  using Change = std::function<void(State&, Wrench&, double magnitude)>;

  double even() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random_); }
  Vector3 direction() { return {even(), even(), even()}; }

  // Asks for rollouts of each pair of shapes at each magnitude, and then for a common one.
  void expect_ends(const Change& change) {
    const Shape shapes[] = {Cylinder{0.05, 0.1},  Capsule{0.05, 0.1},     Sphere{0.05},
                            Box{{0.1, 0.1, 0.1}}, brick({0.1, 0.1, 0.1}), Compound{{{Cylinder{0.05, 0.1}, Pose{}}}}};
    for (const Shape& shape : shapes) {
      for (const Shape& other : shapes) {
        World world(crowd(shape, other));
        const State start = pack(world.scene());
        const State common = world.rollout_unchecked(start, {push({Wrench{}}, 4)}).state;
        for (const double magnitude : magnitudes) {
          State state = start;
          Wrench wrench;
          change(state, wrench, magnitude);
          expect_end(world, state, wrench);
        }
        EXPECT_TRUE(same_bits(world.rollout_unchecked(start, {push({Wrench{}}, 4)}).state, common));
      }
    }
    EXPECT_GT(ended_, 100);
  }

  // The first numbers of a state, three of them from `offset` on, are the object's.
  void set(State& state, int offset, double magnitude) { state.segment<3>(offset) = magnitude * direction(); }

  int diverged_ = 0;

 private:
  void expect_end(World& world, const State& state, const Wrench& wrench) {
    try {
      EXPECT_TRUE(world.rollout_unchecked(state, {push({wrench}, 4)}).state.allFinite());
      ++ended_;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("the simulation diverged"), std::string::npos) << error.what();
      ++diverged_;
    }
    if (!state.allFinite()) return;
    world.contacts(state);
    deepest_contact(world.scene(), state);
    world.distance(state, "object", "neighbour");
  }

  std::mt19937_64 random_{1};
  int ended_ = 0;
};

TEST_F(Divergence, RolloutsAtAnySpeedEnd) {
  expect_ends([this](State& state, Wrench&, double speed) { set(state, StateLayout::velocities_of_body, speed); });
  EXPECT_GT(diverged_, 30);
}

TEST_F(Divergence, RolloutsAtAnySpinEnd) {
  expect_ends([this](State& state, Wrench&, double spin) { set(state, StateLayout::velocities_of_body + 3, spin); });
  EXPECT_GT(diverged_, 30);
}

TEST_F(Divergence, RolloutsUnderAnyWrenchEnd) {
  expect_ends([this](State&, Wrench& wrench, double size) { wrench = {size * direction(), size * direction()}; });
  EXPECT_GT(diverged_, 30);
}

TEST_F(Divergence, RolloutsOfALinkAtAnySpeedEnd) {
  expect_ends([this](State& state, Wrench&, double speed) { state[state.size() - 1] = speed * even(); });
  EXPECT_GT(diverged_, 30);
}

// Too far for the squares of distances, and for the distances themselves: bodies that are so far apart do not touch.
TEST_F(Divergence, RolloutsFromAnyPlaceEnd) {
  expect_ends([this](State& state, Wrench&, double distance) {
    set(state, 0, distance);
    set(state, StateLayout::velocities_of_body, distance);
    set(state, StateLayout::numbers_per_body, distance);
  });
}

}  // namespace
}  // namespace energymargin
