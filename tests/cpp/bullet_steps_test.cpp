// The steps of this library against those of Bullet's own world.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "bullet_world.hpp"
#include "physics/articulated/articulated_bodies.hpp"
#include "physics/contacts/contact_points.hpp"
#include "physics/simulation.hpp"
#include "physics/sweep.hpp"
#include "rollouts.hpp"

namespace energymargin {
namespace {

using namespace scenes;

// A scene in Bullet's own world, which does the steps.
class BulletWorld {
 public:
  explicit BulletWorld(const Scene& scene)
      : scene_(scene),
        shapes_(collision_shapes(scene)),
        bodies_(scene_, shapes_),
        filter_(scene_),
        world_(&dispatcher_.bullet(), &broadphase_, &solver_, &dispatcher_.configuration()),
        axes_before_(scene.bodies().size()) {
    broadphase_.getOverlappingPairCache()->setOverlapFilterCallback(&filter_);
    world_.setGravity(to_bullet(scene.gravity()));
    world_.setForceUpdateAllAabbs(false);
    world_.getDispatchInfo().m_deterministicOverlappingPairs = true;
    world_.getSolverInfo() = solver_settings(scene);
    for (const auto& body : bodies_.rigids().all()) world_.addRigidBody(body.get());
    for (const auto& tree : bodies_.trees()) add_tree(world_, *tree);
    for (btMultiBodyConstraint* row : bodies_.constraints()) world_.addMultiBodyConstraint(row);
  }

  void restore(const State& state) { bodies_.restore(state); }

  void step() {
    const double duration = scene_.stepping().step;
    for (std::size_t i = 0; i < axes_before_.size(); ++i) {
      axes_before_[i] = bodies_.colliders()[i]->getWorldTransform().getBasis();
    }
    bodies_.accelerate(duration);
    world_.stepSimulation(duration, 0);
    turn_normals(dispatcher_.bullet(), axes_before_);
  }

  void read(State& state) const {
    state.resize(StateLayout(scene_).dimension());
    bodies_.read(state);
  }

 private:
  Scene scene_;
  std::vector<CollisionShape> shapes_;
  ArticulatedBodies bodies_;  // also where none is on a joint
  OverlapFilter filter_;
  ContactDispatcher dispatcher_{RoundAlgorithm::bullet};
  btDbvtBroadphase broadphase_;
  ImpulseAudit audit_;
  MultiBodySolver solver_{audit_, MultiBodySolver::Rounds::bullet};
  btMultiBodyDynamicsWorld world_;
  std::vector<btMatrix3x3> axes_before_;
};

// Where a scene is after each of the steps.
template <typename Steps>
std::vector<State> steps(Steps simulation, const State& state, int count) {
  simulation->restore(state);
  std::vector<State> states(static_cast<std::size_t>(count));
  for (State& now : states) {
    simulation->step();
    simulation->read(now);
  }
  return states;
}

std::vector<State> steps_of_ours(const Scene& scene, const State& state, int count) {
  return steps(std::make_unique<Simulation>(scene, Detection::discrete), state, count);
}

std::vector<State> steps_of_bullet(const Scene& scene, const State& state, int count) {
  return steps(std::make_unique<BulletWorld>(scene), state, count);
}

int differing_steps(const Scene& scene, const State& state, int count) {
  const std::vector<State> ours = steps_of_ours(scene, state, count);
  const std::vector<State> bullet = steps_of_bullet(scene, state, count);
  int differing = 0;
  for (std::size_t i = 0; i < ours.size(); ++i) differing += same_bits(ours[i], bullet[i]) ? 0 : 1;
  return differing;
}

// Bodies of all kinds, thrown together over a plane, some with locked axes.
Scene heap(std::uint64_t seed, int friction_directions) {
  std::mt19937_64 random(seed);
  const auto even = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  Stepping stepping;
  stepping.friction_directions = friction_directions;
  Scene scene(Vector3(0.0, 0.0, -g), stepping);
  scene.add_body(fixed("ground", Plane{}));
  scene.add_body(fixed("post", Box{{0.2, 0.2, 1.0}}, {0.0, 0.0, 0.5}));
  const Shape shapes[] = {Box{{0.3, 0.2, 0.1}}, Cylinder{0.1, 0.2}, Sphere{0.1}, Capsule{0.06, 0.2}};
  for (int i = 0; i < 8; ++i) {
    Body thrown = body("body" + std::to_string(i), shapes[i % 4], even(0.2, 2.0),
                       {even(-0.4, 0.4), even(-0.4, 0.4), even(0.15, 0.6)}, i == 0 ? Role::object : Role::none);
    thrown.state.orientation = turn(even(0.0, pi), Vector3(even(-1, 1), even(-1, 1), 1.1).normalized());
    thrown.state.velocity = {even(-2, 2), even(-2, 2), even(-1, 1)};
    thrown.state.angular_velocity = {even(-5, 5), even(-5, 5), even(-5, 5)};
    if (i == 5) thrown.angular_factor = {0.0, 0.0, 1.0};
    if (i == 6) thrown.linear_factor = {1.0, 0.0, 1.0};
    thrown.state.velocity = thrown.state.velocity.cwiseProduct(thrown.linear_factor);
    thrown.state.angular_velocity = thrown.state.angular_velocity.cwiseProduct(thrown.angular_factor);
    scene.add_body(thrown);
  }
  return scene;
}

TEST(BulletSteps, AreOursToTheLastBitWhereThereAreNoJoints) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    for (const int directions : {1, 2}) {
      const Scene scene = heap(seed, directions);
      EXPECT_EQ(differing_steps(scene, pack(scene), 120), 0) << "seed " << seed << ", " << directions;
    }
  }
}

TEST(BulletSteps, AreOursInACrowdedPush) {
  const Scene scene = crowded_push();
  EXPECT_EQ(differing_steps(scene, pack(scene), 500), 0);
}

// Bullet takes the constraints in another order, so the two agree as far as their rounds have converged.
TEST(BulletSteps, OfAHandAreOursWhereTheSolverConverges) {
  Stepping stepping;
  stepping.iterations = 3000;
  stepping.tolerance = 1e-22;
  const Scene scene = hand(1.0, true, stepping);
  const std::vector<State> ours = steps_of_ours(scene, pack(scene), 60);
  const std::vector<State> bullet = steps_of_bullet(scene, pack(scene), 60);
  for (std::size_t i = 0; i < ours.size(); ++i) EXPECT_LT((ours[i] - bullet[i]).cwiseAbs().maxCoeff(), 1e-6) << i;
}

// integrated_pose ends where Bullet's predictIntegratedTransform does, also beyond Bullet's largest turn.
TEST(BulletSteps, MotionEndsWhereItsWayEnds) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  const auto vector = [&](double size) { return btVector3(even(random), even(random), even(random)) * size; };
  btSphereShape ball(0.1);
  for (const double most : {0.0, 1e-4, 0.1, 0.7, 2.0, 30.0, 1e4}) {
    for (int i = 0; i < 50; ++i) {
      btRigidBody body(1.0, nullptr, &ball, btVector3(1, 1, 1));
      const btTransform start(btQuaternion(vector(1.0).normalized(), 3.0 * even(random)), vector(1.0));
      body.setWorldTransform(start);
      body.setLinearVelocity(vector(10.0));
      body.setAngularVelocity(240.0 * vector(most));
      btTransform end;
      body.predictIntegratedTransform(1.0 / 240.0, end);
      const btVector3 turn = integrated_turn(body.getAngularVelocity() / 240.0);
      const btTransform computed = integrated_pose(start, body.getLinearVelocity() / 240.0, turn, 1.0);
      EXPECT_LT((end.getOrigin() - computed.getOrigin()).length(), 1e-15);
      EXPECT_LT(std::acos(std::min(1.0, std::abs(end.getRotation().dot(computed.getRotation())))), 1e-7) << most;
      EXPECT_LE(turn.length(), 3.1416);
    }
  }
}

}  // namespace
}  // namespace energymargin
