// Scenes: what may be added, and how bodies are found again.

#include "energymargin/scene.hpp"

#include <gtest/gtest.h>

#include "expect.hpp"
#include "scenes.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// What adding a default block, changed by `change`, to an empty scene leads to.
template <typename Change>
auto adding(const Change& change) {
  return [change] {
    Body block = body("block", Box{}, 1.0, Vector3::Zero(), Role::object);
    change(block);
    Scene().add_body(block);
  };
}

TEST(Scene, BodiesAreFoundByNameAndByRole) {
  const Scene scene = push_scene();
  EXPECT_EQ(scene.index("effector"), 2u);
  EXPECT_EQ(scene.body("object").mass, 1.0);
  EXPECT_EQ(scene.with_role(Role::object), 1u);
  EXPECT_EQ(Scene().with_role(Role::effector), std::nullopt);
}

TEST(Scene, UnknownBodyIsAnErrorThatListsTheNames) {
  EXPECT_TRUE(rejects([] { push_scene().index("cup"); }, {"'cup'", "'table', 'object', 'effector'"}));
  EXPECT_TRUE(rejects([] { Scene().index("cup"); }, {"'cup'", "none"}));
}

TEST(Scene, BodyThatCannotBeIsRejectedByNameArgumentAndValue) {
  EXPECT_TRUE(rejects(adding([](Body& b) { b.mass = -1.0; }), {"'block'", "mass is -1", "at least 0"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.mass = nan; }), {"'block'", "mass is nan", "finite"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.friction = -0.1; }), {"'block'", "friction is -0.1"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.shape = Sphere{0.0}; }), {"'block'", "radius is 0"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.state.position.y() = infinity; }), {"'block'", "position", "inf"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.state.orientation.w() = 1.1; }), {"'block'", "orientation", "unit"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.linear_factor.z() = 0.5; }), {"'block'", "linear_factor", "0.5"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.angular_factor.x() = -1.0; }), {"'block'", "angular_factor", "-1"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.shape = Plane{}; }), {"'block'", "mass is 1", "plane is fixed"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.mass = 0.0; }), {"'block'", "mass is 0", "object must be able to move"}));
  EXPECT_TRUE(rejects(adding([](Body& b) { b.name = ""; }), {"name", "empty"}));
}

TEST(Scene, NameIsTakenOnlyOnce) {
  Scene scene = push_scene();
  EXPECT_TRUE(rejects([&] { scene.add_body(fixed("table", Plane{})); }, {"name", "'table'", "no other body"}));
}

TEST(Scene, HullOffCentreIsRejectedAndCenteredMendsIt) {
  const ConvexHull off = brick({0.2, 0.2, 0.2}, Quaternion::Identity(), {0.0, 0.0, 0.1});
  Scene scene;
  EXPECT_TRUE(rejects([&] { scene.add_body(body("cup", off, 1.0, Vector3::Zero())); },
                      {"'cup'", "centre of mass", "(0, 0, 0.1)", "centered"}));
  EXPECT_NO_THROW(scene.add_body(body("cup", centered(off), 1.0, Vector3::Zero())));
  EXPECT_NO_THROW(scene.add_body(fixed("shelf", off)));
}

TEST(Scene, SteppingThatCannotBeIsRejected) {
  const auto stepping = [](double step, int iterations, double tolerance, double margin) {
    return [=] { Scene(Vector3::Zero(), Stepping{step, iterations, tolerance, margin}); };
  };
  EXPECT_TRUE(rejects(stepping(0.0, 50, 0.0, 0.001), {"step is 0", "above 0"}));
  EXPECT_TRUE(rejects(stepping(0.01, 0, 0.0, 0.001), {"solver_iterations is 0", "at least 1"}));
  EXPECT_TRUE(rejects(stepping(0.01, 50, -1.0, 0.001), {"solver_tolerance is -1", "at least 0"}));
  EXPECT_TRUE(rejects(stepping(0.01, 50, 0.0, -0.001), {"margin is -0.001", "above 0"}));
  EXPECT_TRUE(rejects([] { Scene(Vector3(0.0, nan, 0.0)); }, {"gravity", "nan"}));
}

}  // namespace
}  // namespace energymargin
