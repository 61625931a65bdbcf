#include "physics/bullet/bullet_engine.hpp"

#include <string>
#include <utility>

#include "physics/bullet/bullet_tree.hpp"
#include "physics/bullet/bullet_world.hpp"

namespace energymargin {
namespace {

[[noreturn]] void refuse(const std::string& what, const std::string& instead) {
  reject("engine", "'bullet', which has no " + what, "engine 'native', or " + instead);
}

void require_bullet_can(const Scene& scene) {
  if (!scene.tendons().empty()) refuse("tendons, as '" + scene.tendons().front().name + "'", "a scene without them");
  if (!scene.loops().empty()) refuse("loops, as of '" + scene.loops().front().body_a + "'", "a scene without them");
  for (const Joint& joint : scene.joints()) {
    if (joint.armature > 0.0) refuse("armature, as of joint '" + joint.name + "'", "armature=0");
  }
  for (const Body& body : scene.bodies()) {
    if (!body.surface_velocity.isZero(0.0)) refuse("surface_velocity, as of '" + body.name + "'", "a body that moves");
  }
}

}  // namespace

// Everything of Bullet's; the library's bodies are where it ends up after each step.
struct BulletEngine::Bullet {
  struct Free {
    FreeBody* body;  // the library's; null: fixed
    std::unique_ptr<btRigidBody> rigid;
  };

  Bullet(const Scene& of, MovingBodies& bodies);
  void configure();
  void add_rigid(std::size_t index, FreeBody* body);
  void add_tree(Articulation& of);
  void add_mimic(const MimicConstraint& mimic);
  void remove_motors();
  void forget();

  const Scene& scene;
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btSimpleBroadphase broadphase{static_cast<int>(scene.bodies().size()) + 1};  // pairs by the bounds of now alone
  OverlapFilter filter;
  ResidualSolver solver;
  SceneWorld world{scene, dispatcher, broadphase, solver, configuration};
  std::vector<Free> rigids;
  std::vector<std::unique_ptr<BulletTree>> trees;
  std::vector<std::unique_ptr<BulletMimic>> mimics;
  std::vector<std::unique_ptr<BulletMotor>> motors;  // of a step
  std::vector<std::unique_ptr<BulletBaseMotor>> base_motors;
};

BulletEngine::Bullet::Bullet(const Scene& of, MovingBodies& bodies) : scene(of), filter(of) {
  configure();
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (scene.bodies()[i].fixed() || bodies.free(i)) add_rigid(i, bodies.free(i));
  }
  for (const auto& tree : bodies.trees()) add_tree(*tree);
  for (const std::vector<MimicConstraint>& group : bodies.mimics()) {
    for (const MimicConstraint& mimic : group) add_mimic(mimic);
  }
}

void BulletEngine::Bullet::configure() {
  configuration.setConvexConvexMultipointIterations();
  configuration.setPlaneConvexMultipointIterations();
  broadphase.getOverlappingPairCache()->setOverlapFilterCallback(&filter);
  world.getDispatchInfo().m_deterministicOverlappingPairs = true;
  world.setForceUpdateAllAabbs(false);
  world.setGravity(btVector3(0.0, 0.0, 0.0));  // it comes with the loads
  btContactSolverInfo& info = world.getSolverInfo();
  info.m_numIterations = scene.stepping().most_iterations();
  info.m_leastSquaresResidualThreshold = scene.stepping().residual();
  info.m_splitImpulse = 1;
  info.m_splitImpulsePenetrationThreshold = 0.0;
  info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
}

void BulletEngine::Bullet::add_rigid(std::size_t index, FreeBody* body) {
  const Body& of = scene.bodies()[index];
  const Inertial& inertial = scene.inertial(index);
  const btVector3 moments = of.dynamic() ? to_bullet(inertial.moments) : btVector3(0.0, 0.0, 0.0);
  btRigidBody::btRigidBodyConstructionInfo info(of.dynamic() ? of.mass : 0.0, nullptr,
                                                scene.collision_shape(index).shape.get(), moments);
  info.m_startWorldTransform = bullet_pose(inertial, of.state);
  rigids.push_back({body, std::make_unique<btRigidBody>(info)});
  btRigidBody& rigid = *rigids.back().rigid;
  rigid.setUserIndex(static_cast<int>(index));
  rigid.setLinearFactor(to_bullet(of.linear_factor));
  rigid.setAngularFactor(to_bullet(of.angular_factor));
  if (of.kinematic) rigid.setCollisionFlags(rigid.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  if (body) rigid.setActivationState(DISABLE_DEACTIVATION);
  world.addRigidBody(&rigid, btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
}

void BulletEngine::Bullet::add_tree(Articulation& of) {
  trees.push_back(std::make_unique<BulletTree>(scene, of));
  BulletTree& tree = *trees.back();
  for (const auto& collider : tree.colliders()) {
    world.addCollisionObject(collider.get(), btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
  }
  world.addMultiBody(&tree.body());
  for (const auto& rows : tree.rows()) world.addMultiBodyConstraint(rows.get());
}

void BulletEngine::Bullet::add_mimic(const MimicConstraint& mimic) {
  const auto side = [this](const JointSum::Term& of) { return trees[of.link.tree]->side(of); };
  mimics.push_back(std::make_unique<BulletMimic>(side(mimic.terms[0]), side(mimic.terms[1]), mimic.constant));
  world.addMultiBodyConstraint(mimics.back().get());
}

// Overlapping pairs with their manifolds, warm starting, and the order in which the solver goes.
void BulletEngine::Bullet::forget() {
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    broadphase.getOverlappingPairCache()->removeOverlappingPairsContainingProxy(
        world.getCollisionObjectArray()[i]->getBroadphaseHandle(), &dispatcher);
  }
  world.updateAabbs();
  solver.reset();
}

BulletEngine::BulletEngine(const Scene& scene) : Engine(scene) {
  require_bullet_can(scene_);
  bullet_ = std::make_unique<Bullet>(scene_, bodies_);
}
BulletEngine::~BulletEngine() = default;

void BulletEngine::forget() {
  for (const Bullet::Free& each : bullet_->rigids) {
    if (!each.body) continue;
    btRigidBody& rigid = *each.rigid;
    const btTransform& pose = bodies_.poses()[each.body->body];
    rigid.setCenterOfMassTransform(pose);
    rigid.setInterpolationWorldTransform(pose);
    rigid.setLinearVelocity(each.body->velocity.linear);
    rigid.setAngularVelocity(each.body->velocity.angular);
    rigid.setInterpolationLinearVelocity(each.body->velocity.linear);
    rigid.setInterpolationAngularVelocity(each.body->velocity.angular);
    rigid.clearForces();
  }
  for (const auto& tree : bullet_->trees) tree->restore();
  for (const auto& mimic : bullet_->mimics) mimic->forget();
  bullet_->forget();
  pairs_.points().clear();
}

SubstepResult BulletEngine::advance(double left) {
  bodies_.drive(motors_);
  load(left);
  for (const Motor& motor : motors_) add_motor(motor);
  bullet_->solver.residual = 0.0;
  bullet_->world.stepSimulation(left, 0);
  bullet_->remove_motors();
  read_back();
  read_contacts();
  last_duration_ = left;
  spring_loads_ = springs_.loads(true);
  return {left, 0.0, bullet_->solver.residual <= scene_.stepping().residual()};
}

// What drives a kinematic body is no row: it is where its velocities bring it.
void BulletEngine::add_motor(const Motor& motor) {
  if (scene_.bodies()[motor.body].kinematic) return;
  if (const auto& link = bodies_.link(motor.body)) {
    bullet_->base_motors.push_back(std::make_unique<BulletBaseMotor>(bullet_->trees[link->tree]->body(), motor));
    return bullet_->world.addMultiBodyConstraint(bullet_->base_motors.back().get());
  }
  for (const Bullet::Free& each : bullet_->rigids) {
    if (!each.body || each.body->body != motor.body) continue;
    bullet_->motors.push_back(std::make_unique<BulletMotor>(*each.rigid, motor));
    bullet_->world.addConstraint(bullet_->motors.back().get());
  }
}

void BulletEngine::Bullet::remove_motors() {
  for (const auto& motor : motors) world.removeConstraint(motor.get());
  for (const auto& motor : base_motors) world.removeMultiBodyConstraint(motor.get());
  motors.clear();
  base_motors.clear();
}

void BulletEngine::load(double duration) {
  load_bodies();
  for (const Bullet::Free& each : bullet_->rigids) {
    if (!each.body) continue;
    const FreeBody& free = *each.body;
    const Body& body = scene_.bodies()[free.body];
    const Velocity& velocity = free.velocity;
    if (free.kinematic) {
      each.rigid->setWorldTransform(
          moved_pose(bodies_.poses()[free.body], velocity.linear * duration, velocity.angular * duration));
      continue;
    }
    each.rigid->applyCentralForce(free.acceleration / free.inverse_mass + free.force);
    each.rigid->applyTorque(free.torque);
    const Velocity damping = damping_of(body, velocity, 1.0 / free.inverse_mass, free.moments,
                                        bodies_.poses()[free.body].getBasis(), duration);
    each.rigid->applyCentralForce(damping.linear);
    each.rigid->applyTorque(damping.angular);
  }
  for (const auto& tree : bullet_->trees) tree->load(scene_.gravity(), duration);
}

void BulletEngine::read_back() {
  for (const Bullet::Free& each : bullet_->rigids) {
    if (!each.body) continue;
    const btRigidBody& rigid = *each.rigid;
    const Velocity velocity =
        each.body->kinematic ? each.body->velocity : Velocity{rigid.getLinearVelocity(), rigid.getAngularVelocity()};
    const BodyState frame = frame_state(scene_.inertial(each.body->body), rigid.getWorldTransform(),
                                        from_bullet(velocity.linear), from_bullet(velocity.angular));
    StateLayout::write(frame, state_.data() + each.body->offset);
  }
  for (const auto& tree : bullet_->trees) tree->read(state_);
  bodies_.put(state_);
  for (FreeBody& free : bodies_.free()) free.pushed = free.velocity;
}

void BulletEngine::read_contacts() {
  std::vector<ContactPoint>& points = pairs_.points();
  points.clear();
  for (int i = 0; i < bullet_->dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *bullet_->dispatcher.getManifoldByIndexInternal(i);
    const std::size_t a = body_of(*manifold.getBody0()), b = body_of(*manifold.getBody1());
    for (int k = 0; k < manifold.getNumContacts(); ++k) {
      const btManifoldPoint& of = manifold.getContactPoint(k);
      ContactPoint point{a,
                         b,
                         of.m_positionWorldOnA,
                         of.m_positionWorldOnB,
                         of.m_positionWorldOnB,
                         of.m_normalWorldOnB,
                         of.getDistance(),
                         of.m_combinedFriction};
      point.normal_impulse = of.m_appliedImpulse;
      point.friction_impulse = of.m_lateralFrictionDir1 * of.m_appliedImpulseLateral1 +
                               of.m_lateralFrictionDir2 * of.m_appliedImpulseLateral2;
      points.push_back(point);
    }
  }
}

}  // namespace energymargin
