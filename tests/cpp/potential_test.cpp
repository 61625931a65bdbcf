// The potential energy of one body.

#include <gtest/gtest.h>

#include "energymargin/world.hpp"
#include "quasistatic/landscape.hpp"
#include "scenes.hpp"

namespace energymargin::quasistatic {
namespace {

using namespace scenes;

// Gravity, a constant force, a centre of mass off the frame, and a spring on either end.
Scene loaded() {
  Scene scene(Vector3(0.3, -0.2, -g));
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}, {0.0, 0.0, 3.0}));
  Body object = body("object", Box{{0.3, 0.2, 0.1}}, 2.0, {1.0, 0.0, 1.0}, Role::object);
  object.force = {1.0, 2.0, 3.0};
  object.inertial = Inertial{{0.02, 0.03, -0.01}, {0.01, 0.02, 0.02}, Quaternion::Identity()};
  scene.add_body(object);
  scene.add_spring({"post", "object", {0.0, 0.05, 0.0}, {0.1, 0.0, 0.05}, 30.0, 0.4, 0.0});
  scene.add_spring({"object", "post", {-0.1, 0.1, 0.0}, {0.0, 0.0, 0.05}, 20.0, 0.0, 0.0});
  return scene;
}

TEST(Potential, ChangesAsTheEnergyOfTheWorldDoes) {
  const Scene scene = loaded();
  const World world(scene);
  const Potential potential(scene, pack(scene), scene.index("object"));
  BodyState start = scene.body("object").state;
  BodyState moved = start;
  moved.position = {0.2, -0.3, 0.5};
  moved.orientation = turn(1.0, Vector3(1.0, 2.0, 3.0).normalized());
  const double gained = world.energy(pack(scene, {{"object", moved}})) - world.energy(pack(scene));
  EXPECT_NEAR(potential({moved.position, moved.orientation}) - potential({start.position, start.orientation}), gained,
              1e-12);
}

TEST(Potential, ForceIsMinusItsSlope) {
  const Scene scene = loaded();
  const Potential potential(scene, pack(scene), scene.index("object"));
  const Pose pose{{0.2, -0.3, 0.5}, turn(1.0, Vector3::UnitX())};
  const double step = 1e-6;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3 along = step * Vector3::Unit(axis);
    const double slope =
        (potential({pose.position + along, pose.orientation}) - potential({pose.position - along, pose.orientation})) /
        (2.0 * step);
    EXPECT_NEAR(potential.force(pose)[axis], -slope, 1e-6);
  }
}

}  // namespace
}  // namespace energymargin::quasistatic
