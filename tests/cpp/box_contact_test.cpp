// Boxes that stand on boxes: no last digit decides whether they touch.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// A box, or a table with four legs, on a box whose upper side is at `height`.
Scene standing(const Shape& shape, double half, double height, const Stepping& stepping = {}) {
  Scene scene(Vector3(0.0, 0.0, -g), stepping);
  scene.add_body(fixed("shelf", Box{{1.0, 1.0, 0.2}}, {0.0, 0.0, height - 0.1}));
  Body made = body("object", shape, 1.0, {0.01, 0.02, height + half}, Role::object);
  made.state.orientation = turn(0.3, Vector3::UnitZ());
  scene.add_body(made);
  return scene;
}

Compound legs() {
  Compound made{{{Box{{0.3, 0.3, 0.02}}, {{0.0, 0.0, 0.11}}}}};
  for (const double x : {-0.13, 0.13}) {
    for (const double y : {-0.13, 0.13}) made.parts.push_back({Box{{0.02, 0.02, 0.1}}, {{x, y, 0.05}}});
  }
  return made;
}

TEST(BoxContact, BoxThatStandsOnABoxBearsItsWeightWhateverTheLastDigit) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> even(-0.5, 0.5);
  for (int i = 0; i < 200; ++i) {
    const double height = even(random);
    for (const bool table : {false, true}) {
      const Scene scene = table ? standing(legs(), 0.0, height) : standing(Box{{0.2, 0.2, 0.1}}, 0.05, height);
      double load = 0.0;
      for (const Contact& contact : World(scene).contacts(pack(scene))) load += contact.normal_force;
      EXPECT_NEAR(load, g, 0.01 * g) << height << ", table " << table;
    }
  }
}

TEST(BoxContact, BoxThatFrictionHoldsStaysOverManyRollouts) {
  Wrench push;
  push.force.x() = 1.0;
  for (const bool table : {false, true}) {
    const Scene scene = table ? standing(legs(), 0.0, 0.137) : standing(Box{{0.2, 0.2, 0.1}}, 0.05, 0.137);
    World world(scene);
    State state = pack(scene);
    double effort = 0.0;
    for (int i = 0; i < 300; ++i) {
      const Rollout rollout = world.rollout(state, {push}, (1 + i % 29) * scene.stepping().step);
      state = rollout.state;
      effort += rollout.effort;
    }
    EXPECT_LT((state - pack(scene)).head<3>().norm(), 5e-4) << table;
    EXPECT_LT(effort, 5e-4) << table;
  }
}

TEST(BoxContact, DepthAndPlaceAreThoseOfTheBoxes) {
  Scene scene(Vector3::Zero(), exact());
  scene.add_body(fixed("shelf", Box{{1.0, 1.0, 0.2}}, {0.0, 0.0, -0.1}));
  scene.add_body(body("object", Box{{0.2, 0.2, 0.1}}, 1.0, {0.0, 0.0, 0.049}, Role::object));
  const std::vector<Contact> contacts = World(scene).contacts(pack(scene));
  ASSERT_EQ(contacts.size(), 4u);
  for (const Contact& contact : contacts) {
    EXPECT_NEAR(contact.distance, -0.001, 1e-12);
    EXPECT_NEAR(std::abs(contact.normal.z()), 1.0, 1e-12);
    EXPECT_NEAR(std::abs(contact.position.x()), 0.1, 1e-5);
    EXPECT_NEAR(std::abs(contact.position.y()), 0.1, 1e-5);
  }
}

}  // namespace
}  // namespace energymargin
