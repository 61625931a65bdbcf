#pragma once
// The floor: a scene in a stock Bullet world, as its manual would have it. No resets, no effort, no tree.

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bullet_world.hpp"
#include "energymargin/kinematics.hpp"
#include "energymargin/world.hpp"
#include "physics/shapes.hpp"

namespace energymargin {

//! Bullet's own classes, with the settings that the library's World has. Fixed and free bodies are rigid bodies, links
//! are multi-bodies. Throws std::invalid_argument on what no task has: links on a free body, loaded
//! links, springs on links, joints that follow others.
class RawScene {
 public:
  explicit RawScene(const Scene& scene);

  //! Puts all bodies where they are in a state. What Bullet has cached it keeps.
  void set(const State& state);

  //! One step, with a wrench on each object.
  void step(const Disturbance& wrenches);

  //! Where an object is, by its index among the objects: the position of its frame [m].
  Vector3 position(std::size_t object) const;

 private:
  struct Free {
    std::size_t body;
    Inertial inertial;
    btRigidBody* rigid;
    btVector3 force;  // that acts all the time
  };

  struct Pulling {
    Spring spring;
    std::pair<btRigidBody*, btVector3> a, b;  // the bodies, and the points where it pulls, in Bullet's frame
  };

  template <typename DynamicsWorld, typename Solver>
  void make_world();
  void configure();
  void add_rigid(std::size_t index);
  void add_trees();
  void add_springs();
  static void pull(const Pulling& spring);

  Scene scene_;
  StateLayout layout_;
  std::vector<std::unique_ptr<btRigidBody>> rigids_;  // by body; null for a link
  std::vector<Free> free_;
  std::vector<Free> objects_;
  std::vector<Pulling> springs_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  OverlapFilter filter_;
  std::vector<std::unique_ptr<BulletTree>> trees_;
  std::unique_ptr<btConstraintSolver> solver_;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
};

inline RawScene::RawScene(const Scene& scene)
    : scene_(scene), layout_(scene), rigids_(scene.bodies().size()), filter_(scene_) {
  if (scene.joints().empty()) {
    make_world<btDiscreteDynamicsWorld, btSequentialImpulseConstraintSolver>();
  } else {
    make_world<btMultiBodyDynamicsWorld, btMultiBodyConstraintSolver>();
  }
  configure();
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (scene.bodies()[i].fixed() || !scene.jointed(i)) add_rigid(i);
  }
  add_trees();
  add_springs();
}

template <typename DynamicsWorld, typename Solver>
void RawScene::make_world() {
  auto solver = std::make_unique<Solver>();
  world_ = std::make_unique<DynamicsWorld>(&dispatcher_, &broadphase_, solver.get(), &configuration_);
  solver_ = std::move(solver);
}

inline void RawScene::configure() {
  broadphase_.getOverlappingPairCache()->setOverlapFilterCallback(&filter_);
  world_->setGravity(to_bullet(scene_.gravity()));
  world_->setForceUpdateAllAabbs(false);
  btContactSolverInfo& info = world_->getSolverInfo();
  info.m_numIterations = scene_.stepping().iterations;
  info.m_leastSquaresResidualThreshold = scene_.stepping().tolerance;
  info.m_splitImpulse = 1;
  info.m_splitImpulsePenetrationThreshold = 0.0;
  info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
}

inline void RawScene::add_rigid(std::size_t index) {
  const Body& body = scene_.bodies()[index];
  const Inertial inertial = body.principal_inertial();
  btRigidBody::btRigidBodyConstructionInfo info(body.mass, nullptr, scene_.collision_shape(index).shape.get(),
                                                to_bullet(inertial.moments));
  info.m_startWorldTransform = bullet_pose(inertial, body.state);
  info.m_friction = body.friction;
  rigids_[index] = std::make_unique<btRigidBody>(info);
  btRigidBody& rigid = *rigids_[index];
  rigid.setUserIndex(static_cast<int>(index));
  rigid.setLinearFactor(to_bullet(body.linear_factor));
  rigid.setAngularFactor(to_bullet(body.angular_factor));
  if (!body.fixed()) rigid.setActivationState(DISABLE_DEACTIVATION);
  world_->addRigidBody(&rigid);
  if (body.fixed()) return;
  free_.push_back({index, inertial, &rigid, to_bullet(body.force)});
  if (body.role == Role::object) objects_.push_back(free_.back());
}

inline void RawScene::add_trees() {
  trees_ = bullet_trees(scene_);
  for (const auto& tree : trees_) add_tree(static_cast<btMultiBodyDynamicsWorld&>(*world_), *tree);
}

inline void RawScene::set(const State& state) {
  for (const Free& free : free_) {
    const BodyState frame = StateLayout::read(state.data() + layout_.offset(free.body));
    const BodyState center = state_at_point(free.inertial.center, frame);
    free.rigid->setCenterOfMassTransform(bullet_pose(free.inertial, frame));
    free.rigid->setLinearVelocity(to_bullet(center.velocity));
    free.rigid->setAngularVelocity(to_bullet(center.angular_velocity));
  }
  for (const auto& tree : trees_) tree->restore(state);
}

inline void RawScene::step(const Disturbance& wrenches) {
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    objects_[i].rigid->applyCentralForce(to_bullet(wrenches[i].force));
    objects_[i].rigid->applyTorque(to_bullet(wrenches[i].torque));
  }
  for (const Free& free : free_) free.rigid->applyCentralForce(free.force);
  for (const Pulling& spring : springs_) pull(spring);
  world_->stepSimulation(scene_.stepping().step, 0);
}

inline void RawScene::add_springs() {
  const auto end = [this](const std::string& name, const Vector3& point) {
    const Inertial inertial = scene_.body(name).principal_inertial();
    btRigidBody* rigid = rigids_[scene_.index(name)].get();
    if (!rigid) throw std::invalid_argument("no floor for a spring on a link: '" + name + "'");
    return std::pair(rigid, to_bullet(Vector3(inertial.axes.conjugate() * (point - inertial.center))));
  };
  for (const Spring& spring : scene_.springs()) {
    springs_.push_back({spring, end(spring.body_a, spring.point_a), end(spring.body_b, spring.point_b)});
  }
}

inline void RawScene::pull(const Pulling& ends) {
  const auto& [spring, a, b] = ends;
  const btVector3 arm_a = a.first->getWorldTransform().getBasis() * a.second;
  const btVector3 arm_b = b.first->getWorldTransform().getBasis() * b.second;
  const btVector3 span = b.first->getCenterOfMassPosition() + arm_b - a.first->getCenterOfMassPosition() - arm_a;
  const double length = span.length();
  if (length == 0.0) return;
  const btVector3 speed = b.first->getVelocityInLocalPoint(arm_b) - a.first->getVelocityInLocalPoint(arm_a);
  const double tension = spring.stiffness * (length - spring.rest_length) + spring.damping * speed.dot(span) / length;
  a.first->applyForce(span * (tension / length), arm_a);
  b.first->applyForce(span * (-tension / length), arm_b);
}

inline Vector3 RawScene::position(std::size_t object) const {
  const Free& free = objects_[object];
  const Vector3 center = from_bullet(free.rigid->getCenterOfMassPosition());
  const Quaternion orientation = from_bullet(free.rigid->getOrientation()) * free.inertial.axes.conjugate();
  return center - orientation * free.inertial.center;
}

}  // namespace energymargin
