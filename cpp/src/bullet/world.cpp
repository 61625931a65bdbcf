// A Scene as a Bullet world. What makes rollouts pure functions is `Bullet::restore`.

#include "energymargin/world.hpp"

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "../check.hpp"
#include "plane_contacts.hpp"
#include "shapes.hpp"

namespace energymargin {
namespace {

// Small pools: a world has few contacts, and a new world is built for every problem.
btDefaultCollisionConstructionInfo small_pools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = 128;
  info.m_defaultMaxCollisionAlgorithmPoolSize = 128;
  return info;
}

// Collects the points of one pair of bodies.
struct PairPoints : btCollisionWorld::ContactResultCallback {
  const btCollisionObject* first;
  double least = std::numeric_limits<double>::infinity();
  Vector3 position = Vector3::Zero();  // on the second body
  Vector3 normal = Vector3::UnitZ();   // to the first body

  PairPoints(const btCollisionObject& a, double reach) : first(&a) { m_closestDistanceThreshold = reach; }

  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int,
                           const btCollisionObjectWrapper*, int, int) override {
    if (point.getDistance() < least) {
      least = point.getDistance();
      const bool swapped = a->getCollisionObject() != first;
      position = from_bullet(swapped ? point.getPositionWorldOnA() : point.getPositionWorldOnB());
      normal = (swapped ? -1.0 : 1.0) * from_bullet(point.m_normalWorldOnB);
    }
    return 0.0;
  }
};

struct Moving {
  std::size_t index;  // in the scene
  int offset;         // in a state
  Quaternion axes;    // from principal axes to the body's frame
  Vector3 inertia;    // principal moments
  btRigidBody* rigid;
};

}  // namespace

class World::Bullet {
 public:
  explicit Bullet(const Scene& scene);
  ~Bullet();

  void restore(const State& state);
  void read(State& state) const;
  void step();
  std::vector<Contact> contacts();
  PairPoints pair(std::size_t a, std::size_t b, double reach);
  double energy(const State& state) const;
  btRigidBody& rigid(std::size_t body) { return *bodies_[body]; }
  const Moving& object() const;
  int whole_steps(double duration) const { return static_cast<int>(std::lround(duration / step_)); }

  Scene scene;
  StateLayout layout;

 private:
  void configure();
  void add(std::size_t index);

  double step_;
  btVector3 gravity_step_;  // change of velocity in one step
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  std::vector<Moving> moving_;
  std::optional<std::size_t> object_;  // in moving_
};

World::Bullet::Bullet(const Scene& scene_)
    : scene(scene_),
      layout(scene_),
      step_(scene.stepping().step),
      gravity_step_(to_bullet(scene.gravity()) * step_),
      configuration_(small_pools()),
      dispatcher_(&configuration_),
      world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
  configure();
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) add(i);
}

World::Bullet::~Bullet() {
  for (auto& body : bodies_) world_.removeRigidBody(body.get());
}

void World::Bullet::configure() {
  use_plane_contacts(dispatcher_);
  world_.setGravity(btVector3(0, 0, 0));
  world_.setForceUpdateAllAabbs(false);
  world_.getDispatchInfo().m_deterministicOverlappingPairs = true;
  btContactSolverInfo& info = world_.getSolverInfo();
  info.m_numIterations = scene.stepping().iterations;
  info.m_leastSquaresResidualThreshold = scene.stepping().tolerance;
  info.m_warmstartingFactor = 1.0;
  // Penetration is resolved by moving bodies apart, not by speeding them up: no energy out of nothing.
  info.m_splitImpulse = 1;
  info.m_splitImpulsePenetrationThreshold = 0.0;
}

void World::Bullet::add(std::size_t index) {
  const Body& body = scene.bodies()[index];
  const MassProperties mass = mass_properties(body.shape, body.mass);
  shapes_.push_back(collision_shape(body.shape, scene.stepping().margin));
  btRigidBody::btRigidBodyConstructionInfo info(body.mass, nullptr, shapes_.back().get(), to_bullet(mass.inertia));
  info.m_startWorldTransform =
      btTransform(to_bullet(Quaternion(body.state.orientation * mass.axes)), to_bullet(body.state.position));
  info.m_friction = body.friction;
  bodies_.push_back(std::make_unique<btRigidBody>(info));
  btRigidBody& rigid = *bodies_.back();
  rigid.setLinearFactor(to_bullet(body.linear_factor));
  rigid.setAngularFactor(to_bullet(body.angular_factor));
  if (body.angular_factor != Vector3::Ones()) {
    // Bullet's gyroscopic term would turn the body about its locked axes.
    rigid.setFlags(rigid.getFlags() & ~BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY);
  }
  rigid.setUserIndex(static_cast<int>(index));
  world_.addRigidBody(&rigid);
  if (body.fixed()) return;
  rigid.setActivationState(DISABLE_DEACTIVATION);
  if (body.role == Role::object && !object_) object_ = moving_.size();
  moving_.push_back({index, layout.offset(index), mass.axes, mass.inertia, &rigid});
}

const Moving& World::Bullet::object() const {
  if (!object_) reject("scene", "without an object", "one body of role \"object\"");
  return moving_[*object_];
}

// Everything that could carry the past into the next rollout is set anew.
void World::Bullet::restore(const State& state) {
  btOverlappingPairCache* pairs = broadphase_.getOverlappingPairCache();
  for (const Moving& body : moving_) {
    const BodyState to = StateLayout::read(state.data() + body.offset);
    const btTransform transform(to_bullet(Quaternion(to.orientation * body.axes)), to_bullet(to.position));
    const btVector3 velocity = to_bullet(to.velocity);
    const btVector3 angular_velocity = to_bullet(to.angular_velocity);
    body.rigid->setCenterOfMassTransform(transform);
    body.rigid->setInterpolationWorldTransform(transform);
    body.rigid->setLinearVelocity(velocity);
    body.rigid->setInterpolationLinearVelocity(velocity);
    body.rigid->setAngularVelocity(angular_velocity);
    body.rigid->setInterpolationAngularVelocity(angular_velocity);
    body.rigid->clearForces();
    pairs->cleanProxyFromPairs(body.rigid->getBroadphaseHandle(), &dispatcher_);
  }
  solver_.reset();
}

void World::Bullet::read(State& state) const {
  state.resize(layout.dimension());
  for (const Moving& body : moving_) {
    const btTransform& transform = body.rigid->getCenterOfMassTransform();
    const Quaternion orientation = from_bullet(transform.getRotation()) * body.axes.conjugate();
    StateLayout::write({from_bullet(transform.getOrigin()), orientation.normalized(),
                        from_bullet(body.rigid->getLinearVelocity()), from_bullet(body.rigid->getAngularVelocity())},
                       state.data() + body.offset);
  }
  if (!state.allFinite()) throw std::runtime_error("the simulation diverged: a state is not finite");
}

// Gravity enters as a change of velocity before the step, as wrenches do: Bullet aims friction against the velocity it
// finds, and so it acts against what the forces are about to do, also on a body at rest.
void World::Bullet::step() {
  for (const Moving& body : moving_) {
    body.rigid->setLinearVelocity(body.rigid->getLinearVelocity() + gravity_step_ * body.rigid->getLinearFactor());
  }
  world_.stepSimulation(step_, 0);
}

std::vector<Contact> World::Bullet::contacts() {
  std::vector<Contact> contacts;
  for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher_.getManifoldByIndexInternal(i);
    const Body& a = scene.bodies()[static_cast<std::size_t>(manifold->getBody0()->getUserIndex())];
    const Body& b = scene.bodies()[static_cast<std::size_t>(manifold->getBody1()->getUserIndex())];
    for (int j = 0; j < manifold->getNumContacts(); ++j) {
      const btManifoldPoint& point = manifold->getContactPoint(j);
      const btVector3 tangential = (point.m_lateralFrictionDir1 * point.m_appliedImpulseLateral1 +
                                    point.m_lateralFrictionDir2 * point.m_appliedImpulseLateral2) /
                                   step_;
      contacts.push_back({a.name, b.name, from_bullet(point.getPositionWorldOnB()), from_bullet(point.m_normalWorldOnB),
                          point.getDistance(), point.getAppliedImpulse() / step_, from_bullet(tangential),
                          a.friction * b.friction});
    }
  }
  return contacts;
}

PairPoints World::Bullet::pair(std::size_t a, std::size_t b, double reach) {
  PairPoints points(rigid(a), reach);
  world_.contactPairTest(&rigid(a), &rigid(b), points);
  return points;
}

double World::Bullet::energy(const State& state) const {
  double energy = 0.0;
  for (const Moving& moving : moving_) {
    const BodyState body = StateLayout::read(state.data() + moving.offset);
    const double mass = scene.bodies()[moving.index].mass;
    const Vector3 spin = (body.orientation * moving.axes).conjugate() * body.angular_velocity;
    energy += 0.5 * mass * body.velocity.squaredNorm() + 0.5 * spin.dot(moving.inertia.cwiseProduct(spin)) -
              mass * scene.gravity().dot(body.position);
  }
  return energy;
}

namespace {

void validate_record(const std::vector<int>& record, int steps) {
  for (std::size_t i = 0; i < record.size(); ++i) {
    if (record[i] < 0 || record[i] > steps || (i > 0 && record[i] <= record[i - 1])) {
      reject("record", "with " + std::to_string(record[i]),
             "ascending numbers of steps from 0 to " + std::to_string(steps));
    }
  }
}

void validate_drive(const Scene& scene, const StateLayout& layout, const Drive& drive, int steps) {
  const std::string name = "drives['" + drive.body + "']";
  if (layout.offset(scene.index(drive.body)) < 0) reject(name, "on a fixed body", "a body that can move");
  if (drive.wrenches.rows() != steps) {
    reject(name, std::to_string(drive.wrenches.rows()) + " rows", std::to_string(steps) + " rows, one a step");
  }
  if (!drive.wrenches.allFinite()) reject(name, "not finite", "finite numbers");
}

}  // namespace

World::World(const Scene& scene) : bullet_(std::make_unique<Bullet>(scene)) {}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

const Scene& World::scene() const { return bullet_->scene; }
const StateLayout& World::layout() const { return bullet_->layout; }

Rollout World::rollout(const State& state, const Wrench& wrench, double duration) {
  validate(bullet_->scene, state);
  require_finite("wrench force", wrench.force);
  require_finite("wrench torque", wrench.torque);
  require_not_negative("duration", duration);
  if (duration > most_steps * bullet_->scene.stepping().step) {
    reject("duration", text(duration), "at most " + std::to_string(most_steps) + " steps");
  }
  Rollout result = rollout_unchecked(state, wrench, bullet_->whole_steps(duration));
  result.energy = bullet_->energy(result.state);
  return result;
}

Rollout World::rollout_unchecked(const State& state, const Wrench& wrench, int steps) {
  const double step = bullet_->scene.stepping().step;
  const btVector3 force = to_bullet(wrench.force);
  const btVector3 torque = to_bullet(wrench.torque);
  btRigidBody& object = *bullet_->object().rigid;
  bullet_->restore(state);
  Rollout result;
  result.steps = steps;
  for (int i = 0; i < steps; ++i) {
    const btVector3 velocity = object.getLinearVelocity();
    const btVector3 spin = object.getAngularVelocity();
    object.applyCentralImpulse(force * step);
    object.applyTorqueImpulse(torque * step);
    bullet_->step();
    // The mean of the velocities before and after makes the work of a free body its gain of kinetic energy, exactly.
    const double power =
        0.5 * (force.dot(velocity + object.getLinearVelocity()) + torque.dot(spin + object.getAngularVelocity()));
    result.effort += std::abs(power) * step;
    result.work += power * step;
  }
  bullet_->read(result.state);
  return result;
}

std::vector<Frame> World::simulate(const State& state, const std::vector<Drive>& drives, int steps,
                                   const std::vector<int>& record) {
  validate(bullet_->scene, state);
  require_at_least("steps", steps, 1);
  validate_record(record, steps);
  for (const Drive& drive : drives) validate_drive(bullet_->scene, bullet_->layout, drive, steps);
  const double step = bullet_->scene.stepping().step;
  std::vector<Frame> frames;
  auto next = record.begin();
  if (next != record.end() && *next == 0) {
    frames.push_back({0.0, state, contacts(state)});
    ++next;
  }
  bullet_->restore(state);
  for (int i = 1; i <= steps && next != record.end(); ++i) {
    for (const Drive& drive : drives) {
      btRigidBody& rigid = bullet_->rigid(bullet_->scene.index(drive.body));
      rigid.applyCentralImpulse(to_bullet(Vector3(drive.wrenches.row(i - 1).head<3>() * step)));
      rigid.applyTorqueImpulse(to_bullet(Vector3(drive.wrenches.row(i - 1).tail<3>() * step)));
    }
    bullet_->step();
    if (i != *next) continue;
    frames.push_back({i * step, {}, bullet_->contacts()});
    bullet_->read(frames.back().state);
    ++next;
  }
  return frames;
}

double World::energy(const State& state) const {
  validate(bullet_->scene, state);
  return bullet_->energy(state);
}

std::vector<Contact> World::contacts(const State& state) {
  validate(bullet_->scene, state);
  bullet_->restore(state);
  bullet_->step();
  return bullet_->contacts();
}

double World::distance(const State& state, const std::string& body_a, const std::string& body_b) {
  const std::size_t a = bullet_->scene.index(body_a);
  const std::size_t b = bullet_->scene.index(body_b);
  if (a == b) reject("body_b", "'" + body_b + "'", "another body than body_a");
  validate(bullet_->scene, state);
  bullet_->restore(state);
  return bullet_->pair(a, b, 1e9).least;
}

Contact World::deepest_contact(const State& state) {
  validate(bullet_->scene, state);
  bullet_->restore(state);
  const std::vector<Body>& bodies = bullet_->scene.bodies();
  Contact deepest;
  for (std::size_t a = 0; a < bodies.size(); ++a) {
    for (std::size_t b = a + 1; b < bodies.size(); ++b) {
      if (bodies[a].fixed() && bodies[b].fixed()) continue;
      const PairPoints points = bullet_->pair(a, b, 0.0);
      if (points.least >= deepest.distance) continue;
      deepest.body_a = bodies[a].name;
      deepest.body_b = bodies[b].name;
      deepest.distance = points.least;
      deepest.position = points.position;
      deepest.normal = points.normal;
      deepest.friction = bodies[a].friction * bodies[b].friction;
    }
  }
  return deepest;
}

}  // namespace energymargin
