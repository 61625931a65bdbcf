// Bodies whose motion is damped.

#include <gtest/gtest.h>

#include <cmath>

#include "energymargin/audit.hpp"
#include "expect.hpp"
#include "mechanisms.hpp"

namespace energymargin {
namespace {

using namespace scenes;

Body damped(double linear, double angular) {
  Body box = body("object", Box{{0.2, 0.1, 0.05}}, 2.0, Vector3::Zero(), Role::object);
  box.linear_damping = linear;
  box.angular_damping = angular;
  return box;
}

TEST(Damping, FallEndsAtTheSpeedAtWhichItBearsTheWeight) {
  Scene scene(Vector3(0.0, 0.0, -g));
  scene.add_body(damped(4.0, 0.0));
  const State end = after(scene, pack(scene), 2400);
  EXPECT_NEAR(body_in(scene, end, "object").velocity.z(), -2.0 * g / 4.0, 1e-6);
}

TEST(Damping, SpinAndSpeedDecay) {
  for (const double step : {1.0 / 240.0, 1.0 / 960.0}) {
    Stepping stepping;
    stepping.step = step;
    Scene scene(Vector3::Zero(), stepping);
    Body box = damped(1.0, 0.002);
    box.state.velocity = {1.0, 0.5, 0.0};
    box.state.angular_velocity = {0.0, 0.0, 3.0};
    scene.add_body(box);
    const int steps = static_cast<int>(std::lround(1.0 / step));
    const BodyState end = body_in(scene, after(scene, pack(scene), steps), "object");
    const double moment = box.principal_inertial().moments.z();
    EXPECT_NEAR(end.velocity.x(), std::exp(-1.0 / 2.0), 0.15 * step);
    EXPECT_NEAR(end.angular_velocity.z(), 3.0 * std::exp(-0.002 / moment), 0.5 * step);
  }
}

// Of bodies that move along some axes alone, and of one that carries links.
TEST(Damping, ItsWorkIsInTheAudit) {
  for (const Vector3& factor : {Vector3(1.0, 1.0, 1.0), Vector3(0.0, 1.0, 1.0), Vector3(0.0, 0.0, 1.0)}) {
    Scene scene(Vector3::Zero());
    Body box = damped(1.0, 0.01);
    box.angular_factor = factor;
    box.state.angular_velocity = Vector3(1.0, 2.0, 3.0).cwiseProduct(factor);
    box.state.velocity = {0.0, 1.0, 0.0};
    scene.add_body(box);
    const Audit audit = *World(scene).rollout(pack(scene), {Wrench{}}, 1.0, true).audit;
    EXPECT_NEAR(audit.damping, audit.energy_change, 1e-3 * std::abs(audit.energy_change));
    EXPECT_LT(audit.energy_change, -0.1);
    EXPECT_NEAR(audit.leftover(), 0.0, 1e-6);
  }
  Scene scene(Vector3::Zero());
  Body base = damped(1.0, 0.01);
  base.state.velocity = {0.0, 1.0, 0.0};
  base.state.angular_velocity = {1.0, 2.0, 3.0};
  scene.add_body(base);
  scene.add_body(body("link", Box{{0.1, 0.05, 0.05}}, 0.5, Vector3::Zero()));
  scene.add_joint(joint("hinge", JointType::revolute, "object", "link", Vector3::UnitY(), {0.2, 0.0, 0.0}));
  const Audit audit = *World(scene).rollout(pack(scene), {Wrench{}}, 1.0, true).audit;
  EXPECT_LT(audit.damping, -0.1);
  EXPECT_NEAR(audit.leftover(), 0.0, 1e-6);
}

TEST(Damping, IsOfNoLinkAndNoKinematicBody) {
  Scene scene;
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}));
  scene.add_body(damped(1.0, 0.0));
  EXPECT_TRUE(rejects([&] { scene.add_joint(joint("j", JointType::revolute, "post", "object", Vector3::UnitZ())); },
                      {"'object'", "without damping"}));
  Body hand = damped(0.0, 1.0);
  hand.name = "hand";
  hand.role = Role::effector;
  hand.kinematic = true;
  EXPECT_TRUE(rejects([&] { scene.add_body(hand); }, {"angular_damping"}));
  EXPECT_TRUE(rejects([&] { Scene().add_body(damped(-1.0, 0.0)); }, {"linear_damping", "-1"}));
}

}  // namespace
}  // namespace energymargin
