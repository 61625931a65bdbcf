// The steps of this library against those of Bullet's own world.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>

#include "bullet_world.hpp"
#include "physics/contacts/contact_points.hpp"
#include "physics/contacts/dispatcher.hpp"
#include "physics/rigid_bodies.hpp"
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
        trees_(bullet_trees(scene_, shapes_)),
        colliders_(scene.bodies().size()),
        filter_(scene_),
        world_(&dispatcher_.bullet(), &broadphase_, &solver_, &dispatcher_.configuration()),
        axes_before_(scene.bodies().size()) {
    broadphase_.getOverlappingPairCache()->setOverlapFilterCallback(&filter_);
    world_.setGravity(to_bullet(scene.gravity()));
    world_.setForceUpdateAllAabbs(false);
    world_.getDispatchInfo().m_deterministicOverlappingPairs = true;
    world_.getSolverInfo() = solver_settings(scene);
    for (const auto& body : bodies_.all()) {
      colliders_[body_index(*body)] = body.get();
      world_.addRigidBody(body.get());
    }
    for (const auto& tree : trees_) {
      for (const auto& collider : tree->colliders()) colliders_[body_index(*collider)] = collider.get();
      add_tree(world_, *tree);
    }
  }

  void restore(const State& state) {
    bodies_.restore(state);
    for (const auto& tree : trees_) tree->restore(state);
  }

  void step() {
    const double duration = scene_.stepping().step;
    for (std::size_t i = 0; i < axes_before_.size(); ++i) {
      axes_before_[i] = colliders_[i]->getWorldTransform().getBasis();
    }
    bodies_.accelerate(duration);
    world_.stepSimulation(duration, 0);
    turn_normals(dispatcher_.bullet(), axes_before_);
  }

  void read(State& state) const {
    state.resize(StateLayout(scene_).dimension());
    bodies_.read(state);
    for (const auto& tree : trees_) tree->read(state);
  }

 private:
  Scene scene_;
  std::vector<CollisionShape> shapes_;
  RigidBodies bodies_;
  std::vector<std::unique_ptr<BulletTree>> trees_;
  std::vector<btCollisionObject*> colliders_;  // of all bodies, in the scene's order
  OverlapFilter filter_;
  ContactDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btMultiBodyConstraintSolver solver_;
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

// How far one step of ours ends from one of Bullet's, from each of some states on [m, rad, m/s, rad/s].
std::vector<double> apart_after_a_step(const Scene& scene, const std::vector<State>& states) {
  std::vector<double> apart;
  for (const State& state : states) {
    const State ours = steps_of_ours(scene, state, 1).front();
    const State bullet = steps_of_bullet(scene, state, 1).front();
    apart.push_back((ours - bullet).cwiseAbs().maxCoeff());
  }
  return apart;
}

// Bodies of all kinds, thrown together over a plane, some with locked axes.
Scene heap(std::uint64_t seed, double friction) {
  std::mt19937_64 random(seed);
  const auto even = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  Stepping stepping;
  stepping.iterations = 3000;
  stepping.tolerance = 1e-22;
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
    thrown.friction = friction;
    if (i == 5) thrown.angular_factor = {0.0, 0.0, 1.0};
    if (i == 6) thrown.linear_factor = {1.0, 0.0, 1.0};
    thrown.state.velocity = thrown.state.velocity.cwiseProduct(thrown.linear_factor);
    thrown.state.angular_velocity = thrown.state.angular_velocity.cwiseProduct(thrown.angular_factor);
    scene.add_body(thrown);
  }
  return scene;
}

// Over heaps that fall and come to rest, sorted.
std::vector<double> apart_in_heaps(double friction) {
  constexpr std::size_t between = 6;  // steps
  std::vector<double> apart;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const Scene scene = heap(seed, friction);
    std::vector<State> states;
    const std::vector<State> all = steps_of_ours(scene, pack(scene), 120);
    for (std::size_t i = 0; i < all.size(); i += between) states.push_back(all[i]);
    for (const double distance : apart_after_a_step(scene, states)) apart.push_back(distance);
  }
  std::sort(apart.begin(), apart.end());
  return apart;
}

TEST(BulletSteps, AreOursWhereThereAreNoJoints) { EXPECT_LT(apart_in_heaps(0.0).back(), 1e-11); }

// Bullet leaves friction as it is at a contact whose normal impulse has gone to zero in the same step; here it goes
// too.
TEST(BulletSteps, AreOursWithFrictionButWhereContactsOpenAgain) {
  const std::vector<double> apart = apart_in_heaps(0.5);
  EXPECT_LT(apart[apart.size() / 2], 1e-9);
  EXPECT_LT(apart[apart.size() * 3 / 4], 1e-4);
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

// A tree that branches, with hinges, a rail and a held joint, whose drives throw it about, one beyond its torque limit.
Scene thrown_tree() {
  Stepping stepping;
  stepping.iterations = 3000;
  stepping.tolerance = 1e-26;
  Scene scene(Vector3(0.0, 0.0, -g), stepping);
  scene.add_body(fixed("post", Box{{0.1, 0.1, 0.1}}, {0.2, -0.1, 0.3}));
  const auto add = [&](const std::string& parent, const std::string& link, JointType type, const Vector3& axis) {
    scene.add_body(
        body(link, brick({0.04, 0.06, 0.2}, turn(0.4, Vector3(1.0, 2.0, -1.0).normalized())), 0.3, Vector3::Zero()));
    Joint made = joint(link, type, parent, link, axis, {0.01, 0.02, -0.1}, {-0.01, 0.0, 0.1});
    made.in_parent.orientation = turn(0.3, Vector3(0.0, 1.0, 1.0).normalized());
    made.stiffness = type == JointType::prismatic ? 100.0 : 2.0;
    made.damping = 0.01;
    made.target = type == JointType::prismatic ? 0.05 : -0.8;
    made.torque_limit = link == "hand" ? 0.2 : std::numeric_limits<double>::infinity();
    made.held = link == "wrist";
    made.state = {0.1, link == "wrist" ? 0.0 : 1.0};
    scene.add_joint(made);
  };
  add("post", "upper arm", JointType::revolute, Vector3::UnitY());
  add("upper arm", "rail", JointType::prismatic, Vector3::UnitZ());
  add("rail", "wrist", JointType::revolute, Vector3::UnitX());
  add("wrist", "hand", JointType::revolute, Vector3::UnitX());
  add("upper arm", "elbow", JointType::revolute, Vector3(1.0, 1.0, 0.0).normalized());
  for (const Body& a : scene.bodies()) {
    for (const Body& b : scene.bodies()) {
      if (a.name < b.name) scene.disable_collisions(a.name, b.name);
    }
  }
  return scene;
}

// Bullet's is the articulated-body algorithm, and a drive a row of its solver.
TEST(BulletSteps, OfAThrownTreeAreOurs) {
  const Scene scene = thrown_tree();
  const std::vector<State> ours = steps_of_ours(scene, pack(scene), 120);
  const std::vector<State> bullet = steps_of_bullet(scene, pack(scene), 120);
  EXPECT_GT((ours.back() - ours.front()).cwiseAbs().maxCoeff(), 0.5);
  for (std::size_t i = 0; i < ours.size(); ++i) EXPECT_LT((ours[i] - bullet[i]).cwiseAbs().maxCoeff(), 1e-9) << i;
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
