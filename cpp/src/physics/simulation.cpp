#include "physics/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/check.hpp"
#include "energymargin/kinematics.hpp"
#include "physics/contacts/box_contacts.hpp"
#include "physics/contacts/pair_contacts.hpp"
#include "physics/contacts/plane_contacts.hpp"
#include "physics/contacts/round_contacts.hpp"
#include "physics/shapes.hpp"

namespace energymargin {
namespace {

// An axis this close to a principal one is that one: 1 - cosine.
constexpr double principal_slack = 1e-12;

// Rounds over the joints' rows in each of the solver's. Where a follower is heavier than what it follows, as its
// multiplier makes it, one row undoes most of what the other did, and they need many.
constexpr int mimic_rounds = 10;

// Parts of a step in which bodies come into contact with each other; the rest of it is lost then, and nothing moves.
constexpr int most_parts = 8;

// Of a part's length it is tried to find the one that ends in contact.
constexpr int most_tries = 4;

// Of what the solver left over, this share is put right in a whole step; Bullet's own value.
constexpr double error_share = 0.2;

// A part that would be shorter than this share of a step is not tried: bodies are in contact already. If they turn into
// each other, a part of this share of the one before may be short enough for penetration recovery.
constexpr double shortest_part = 1e-4;
constexpr double blocked_share = 0.25;

// Small pools: a world has few contacts, and a new world is built for every problem.
btDefaultCollisionConstructionInfo small_pools() {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = 128;
  info.m_defaultMaxCollisionAlgorithmPoolSize = 128;
  info.m_customCollisionAlgorithmMaxElementSize = contacts_size;
  return info;
}

// The only axis about which a body is free to turn.
std::optional<int> only_axis(const Vector3& angular_factor) {
  int axis = 0;
  if (angular_factor.sum() != 1.0 || angular_factor.maxCoeff(&axis) != 1.0) return std::nullopt;
  return axis;
}

std::size_t body_of(const btCollisionObject& object) { return static_cast<std::size_t>(object.getUserIndex()); }

}  // namespace

btScalar PairPoints::addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int,
                                     const btCollisionObjectWrapper*, int, int) {
  if (point.getDistance() < least) {
    least = point.getDistance();
    const bool swapped = a->getCollisionObject() != first;
    position = from_bullet(swapped ? point.getPositionWorldOnA() : point.getPositionWorldOnB());
    normal = (swapped ? -1.0 : 1.0) * from_bullet(point.m_normalWorldOnB);
  }
  return 0.0;
}

bool SeparatePairs::needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const {
  if (!(a->m_collisionFilterGroup & b->m_collisionFilterMask) ||
      !(b->m_collisionFilterGroup & a->m_collisionFilterMask)) {
    return false;
  }
  return !contains(body_of(*static_cast<btCollisionObject*>(a->m_clientObject)),
                   body_of(*static_cast<btCollisionObject*>(b->m_clientObject)));
}

Simulation::Simulation(const Scene& scene, Steps steps)
    : scene_(scene),
      layout_(scene),
      step_(scene.stepping().step),
      configuration_(small_pools()),
      dispatcher_(&configuration_),
      world_(&dispatcher_, &broadphase_, &solver_, &configuration_),
      colliders_(scene.bodies().size()),
      before_(scene.bodies().size()),
      tree_of_(scene.bodies().size()) {
  configure(steps);
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    const Body& body = scene.bodies()[i];
    inertials_.push_back(body.principal_inertial());
    shapes_.push_back(collision_shape(body, scene.stepping().margin));
    if (body.fixed() || !scene.jointed(i)) add_rigid(i);
  }
  add_articulations();
  add_mimics();
  if (steps != Steps::bullet) add_stepper(steps);
  for (std::size_t i = 0; i < scene.bodies().size(); ++i) {
    if (tree_of_[i] && !scene.bodies()[i].force.isZero(0.0)) loaded_links_.push_back(i);
  }
  for (const Spring& spring : scene.springs()) {
    spring_ends_.emplace_back(scene.index(spring.body_a), scene.index(spring.body_b));
  }
}

Simulation::~Simulation() {
  stepper_.reset();
  for (auto& mimic : mimics_) world_.removeMultiBodyConstraint(mimic.get());
  articulations_.clear();
  for (auto& body : rigids_) world_.removeRigidBody(body.get());
}

void Simulation::configure(Steps steps) {
  use_plane_contacts(dispatcher_);
  use_box_contacts(dispatcher_);
  hull_contacts_.use_in(dispatcher_);
  if (steps != Steps::bullet) use_round_contacts(dispatcher_);
  solver_.use_own_rounds(steps != Steps::bullet);
  for (const Joint& joint : scene_.joints()) separate_.add(scene_.index(joint.parent), scene_.index(joint.child));
  for (const auto& [a, b] : scene_.disabled_collisions()) separate_.add(scene_.index(a), scene_.index(b));
  if (!separate_.pairs.empty()) broadphase_.getOverlappingPairCache()->setOverlapFilterCallback(&separate_);
  world_.setGravity(to_bullet(scene_.gravity()));
  world_.setForceUpdateAllAabbs(false);
  world_.getDispatchInfo().m_deterministicOverlappingPairs = true;
  btContactSolverInfo& info = world_.getSolverInfo();
  info.m_numIterations = scene_.stepping().iterations;
  info.m_leastSquaresResidualThreshold = scene_.stepping().tolerance;
  if (scene_.stepping().friction_directions == 1) info.m_solverMode &= ~SOLVER_USE_2_FRICTION_DIRECTIONS;
  info.m_solverMode |= SOLVER_USE_ARTICULATED_WARMSTARTING;
  info.m_articulatedWarmstartingFactor = 1.0;
  info.m_warmstartingFactor = 1.0;
  // Penetration recovery by split impulses changes positions and not velocities: no energy out of nothing.
  info.m_splitImpulse = 1;
  info.m_splitImpulsePenetrationThreshold = 0.0;
}

void Simulation::add_rigid(std::size_t index) {
  const Body& body = scene_.bodies()[index];
  const Inertial& inertial = inertials_[index];
  btRigidBody::btRigidBodyConstructionInfo info(body.mass, nullptr, shapes_[index].shape.get(),
                                                to_bullet(inertial.moments));
  info.m_startWorldTransform = bullet_pose(inertial, body.state);
  info.m_friction = body.friction;
  rigids_.push_back(std::make_unique<btRigidBody>(info));
  btRigidBody& rigid = *rigids_.back();
  colliders_[index] = &rigid;
  rigid.setLinearFactor(to_bullet(body.linear_factor));
  rigid.setAngularFactor(to_bullet(body.angular_factor));
  rigid.setFlags(rigid.getFlags() | BT_DISABLE_WORLD_GRAVITY);  // `step` brings it
  if (body.angular_factor != Vector3::Ones()) {
    // Bullet's gyroscopic term would turn the body about its locked axes.
    rigid.setFlags(rigid.getFlags() & ~BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY);
  }
  rigid.setUserIndex(static_cast<int>(index));
  world_.addRigidBody(&rigid);
  if (body.fixed()) return;
  rigid.setActivationState(DISABLE_DEACTIVATION);
  if (body.role == Role::object) objects_.push_back(&rigid);
  const Vector3 acceleration = (scene_.gravity() + body.force / body.mass).cwiseProduct(body.linear_factor);
  free_.push_back({layout_.offset(index), inertial, to_bullet(acceleration), &rigid, only_axis(body.angular_factor)});
}

// What hangs on a free body is one tree; on a fixed body each child starts a tree of its own, so that two robots on one
// table know nothing of each other.
void Simulation::add_articulations() {
  const auto add = [this](std::size_t base, std::optional<std::size_t> first) {
    articulations_.push_back(std::make_unique<Articulation>(scene_, shapes_, base, first, world_));
    for (const auto& collider : articulations_.back()->colliders()) {
      colliders_[body_of(*collider)] = collider.get();
      tree_of_[body_of(*collider)] = articulations_.size() - 1;
    }
  };
  for (std::size_t i = 0; i < scene_.joints().size(); ++i) {
    const std::size_t parent = scene_.index(scene_.joints()[i].parent);
    if (scene_.bodies()[parent].fixed()) {
      add(parent, i);
    } else if (!scene_.joint_to(parent) && !tree_of_[parent]) {
      add(parent, std::nullopt);
    }
  }
}

void Simulation::add_stepper(Steps steps) {
  if (articulations_.empty()) {
    auto bodies = std::make_unique<FreeBodies>(dispatcher_);
    for (const Free& body : free_) bodies->add(*body.rigid);
    contact_solver_ = &bodies->solver();
    stepper_ = std::move(bodies);
  } else {
    auto bodies = std::make_unique<ArticulatedBodies>(dispatcher_, solver_, world_);
    for (const Free& body : free_) bodies->add(*body.rigid);
    for (const auto& articulation : articulations_) {
      for (const auto& collider : articulation->colliders()) bodies->add(*collider);
    }
    stepper_ = std::move(bodies);
  }
  if (steps == Steps::own) continuous_.emplace(shapes_);
  velocities_.resize(colliders_.size());
  for (std::size_t a = 0; a < colliders_.size(); ++a) {
    for (std::size_t b = a + 1; b < colliders_.size(); ++b) {
      if (!can_collide(a, b)) continue;
      stepper_->pairs().add(*colliders_[a], *colliders_[b]);
      if (continuous_) continuous_->add(*colliders_[a], *colliders_[b]);
    }
  }
}

void Simulation::watch(const Motion* before) {
  if (contact_solver_) {
    contact_solver_->watch(before);
  } else {
    solver_.watch(before);
  }
}

const ImpulseWork& Simulation::impulse_work() const {
  return contact_solver_ ? contact_solver_->work() : solver_.work();
}

void Simulation::set_impulse_work(const ImpulseWork& work) {
  if (contact_solver_) {
    contact_solver_->set_work(work);
  } else {
    solver_.set_work(work);
  }
}

int Simulation::whole_steps(double duration) const { return static_cast<int>(std::lround(duration / step_)); }

// A joint and the one that it follows may be on two trees.
void Simulation::add_mimics() {
  const auto link_of = [this](std::size_t joint) -> JointPlace {
    for (const auto& articulation : articulations_) {
      if (const auto place = articulation->place_of(joint)) return *place;
    }
    throw std::logic_error("a joint that is on no tree");
  };
  for (std::size_t i = 0; i < scene_.joints().size(); ++i) {
    const auto& mimic = scene_.joints()[i].mimic;
    if (!mimic) continue;
    const std::size_t followed = scene_.joint_index(mimic->joint);
    if (scene_.joints()[followed].held) continue;  // then both are rigid
    mimics_.push_back(std::make_unique<MimicRow>(link_of(i), link_of(followed), *mimic));
    world_.addMultiBodyConstraint(mimics_.back().get());
  }
  if (!mimics_.empty()) world_.getSolverInfo().m_numNonContactInnerIterations = mimic_rounds;
}

const std::vector<btRigidBody*>& Simulation::objects() const {
  if (objects_.empty()) reject("scene", "without a free object", "a body of role \"object\" that is on no joint");
  return objects_;
}

// About its only free axis a body turns by its moment about that axis. Bullet would take the inverse inertia's part,
// which is another number where the axis is none of the principal ones.
void Simulation::set_moment(const Free& body) {
  const Vector3 axis = from_bullet(body.rigid->getWorldTransform().getBasis()[*body.turning_axis]);
  const bool principal = axis.cwiseAbs().maxCoeff() > 1.0 - principal_slack;
  const Vector3& moments = body.inertial.moments;
  const Vector3 acting = principal ? moments : Vector3::Constant(moments.dot(axis.cwiseAbs2()));
  body.rigid->setInvInertiaDiagLocal(to_bullet(Vector3(acting.cwiseInverse())));
  body.rigid->updateInertiaTensor();
}

// Everything that could carry the past into the next rollout is set anew.
void Simulation::restore(const State& state) {
  for (const Free& body : free_) {
    const BodyState frame = StateLayout::read(state.data() + body.offset);
    const BodyState to = state_at_point(body.inertial.center, frame);
    const btTransform transform = bullet_pose(body.inertial, frame);
    const btVector3 velocity = to_bullet(to.velocity);
    const btVector3 angular_velocity = to_bullet(to.angular_velocity);
    body.rigid->setCenterOfMassTransform(transform);
    body.rigid->setInterpolationWorldTransform(transform);
    body.rigid->setLinearVelocity(velocity);
    body.rigid->setInterpolationLinearVelocity(velocity);
    body.rigid->setAngularVelocity(angular_velocity);
    body.rigid->setInterpolationAngularVelocity(angular_velocity);
    if (body.turning_axis) set_moment(body);
    body.rigid->clearForces();
  }
  for (const auto& articulation : articulations_) articulation->restore(state);
  for (const auto& mimic : mimics_) mimic->forget();
  solver_.reset();
  forget_contacts();
  if (continuous_) continuous_->forget();
  last_duration_ = 0.0;
  unload();
  find_pulls();
}

void Simulation::forget_contacts() {
  if (stepper_) return stepper_->pairs().forget();
  const auto forget = [this](btCollisionObject& body) {
    broadphase_.getOverlappingPairCache()->cleanProxyFromPairs(body.getBroadphaseHandle(), &dispatcher_);
  };
  for (const Free& body : free_) forget(*body.rigid);
  for (const auto& articulation : articulations_) {
    for (const auto& collider : articulation->colliders()) forget(*collider);
  }
}

void Simulation::read(State& state) const {
  state.resize(layout_.dimension());
  for (const Free& body : free_) {
    const btTransform& transform = body.rigid->getCenterOfMassTransform();
    const Quaternion orientation = from_bullet(transform.getRotation()) * body.inertial.axes.conjugate();
    const BodyState center{from_bullet(transform.getOrigin()), orientation.normalized(),
                           from_bullet(body.rigid->getLinearVelocity()), from_bullet(body.rigid->getAngularVelocity())};
    StateLayout::write(state_at_point(-body.inertial.center, center), state.data() + body.offset);
  }
  for (const auto& articulation : articulations_) articulation->read(state);
  if (!state.allFinite()) throw Diverged("a state");
}

void Simulation::read(Motion& motion) const {
  const btVector3 none(0, 0, 0);
  motion.bodies.assign(colliders_.size(), {none, none, none, none});
  for (const Free& body : free_) {
    motion.bodies[body_of(*body.rigid)] = {body.rigid->getLinearVelocity(), body.rigid->getAngularVelocity(),
                                           body.acceleration / body.rigid->getInvMass(), none};
  }
  for (std::size_t i = 0; i < spring_ends_.size(); ++i) {
    const Span now = span(i);
    const double tension = scene_.springs()[i].stiffness * (now.length - scene_.springs()[i].rest_length);
    for_each_pull(i, now, tension, [&motion](const Load& pull) {
      motion.bodies[pull.body].force += pull.force;
      motion.bodies[pull.body].torque += pull.torque;
    });
  }
  for (const auto& articulation : articulations_) {
    const btMultiBody& tree = articulation->tree();
    const btScalar* first = tree.getVelocityVector();
    motion.trees[&tree].assign(first, first + base_velocities + tree.getNumDofs());
  }
}

void Simulation::read(std::vector<Velocity>& velocities) const {
  velocities.resize(colliders_.size());
  stepper_->read(velocities);
}

void Simulation::step() {
  double left = step_;
  for (int parts = 0; left > 0.0; ++parts) left -= advance(left, parts).duration;
}

// A part's length is known once its velocities are: if bodies would pass into each other, it is done again, as short as
// they are safe.
Advance Simulation::advance(double duration, int parts) {
  for (std::size_t i = 0; i < colliders_.size(); ++i) before_[i] = colliders_[i]->getWorldTransform().getBasis();
  Advance done{duration, 0.0};
  if (!stepper_) {
    accelerate(duration);
    world_.stepSimulation(duration, 0);
  } else {
    done = advance_safely(duration, parts);
  }
  turn_normals();
  find_pulls();
  return done;
}

Advance Simulation::advance_safely(double duration, int parts) {
  stepper_->keep();
  const ImpulseWork work = impulse_work();
  for (int tries = 1;; ++tries) {
    accelerate(duration);
    if (tries == 1) stepper_->pairs().update();
    solve(duration);
    // What moves rigid bodies out of each other knows nothing of links.
    if (continuous_ && !articulations_.empty() && continuous_->is_squeezed(stepper_->pairs()))
      stepper_->undo_split_impulses();
    const double share = continuous_ ? safe_share(duration) : 1.0;
    const double shorter = duration * (share * duration > shortest_part * step_ ? share : blocked_share);
    if (share < 1.0 && tries < most_tries && parts < most_parts && shorter > shortest_part * step_) {
      stepper_->undo();
      set_impulse_work(work);
      duration = shorter;
      continue;
    }
    stepper_->move(duration, share);
    return {duration, (1.0 - share) * duration};
  }
}

void Simulation::solve(double duration) {
  btContactSolverInfo& info = world_.getSolverInfo();
  // The solver starts from the impulses of the last part. If that was longer, so are they; if it was shorter, they may
  // be of an impact, which does not grow with time.
  info.m_warmstartingFactor = last_duration_ > 0.0 ? std::min(1.0, duration / last_duration_) : 1.0;
  info.m_articulatedWarmstartingFactor = info.m_warmstartingFactor;
  // Of an overlap, and of a mimic's error, the share that is put right in this part: links are moved out by a velocity,
  // which would have no bound in short parts.
  info.m_erp2 = error_share * (duration / step_);
  stepper_->solve(duration, info);
  last_duration_ = duration;
}

double Simulation::safe_share(double duration) {
  stepper_->read(velocities_);
  return continuous_->safe_share(stepper_->pairs(), velocities_, duration);
}

// Gravity enters as a change of velocity before the step, as wrenches do: Bullet aims friction against the velocity it
// finds, and so it acts against what the forces are about to do, also on a body at rest.
void Simulation::accelerate(double duration) {
  for (const Load& load : loads_) apply(load, duration);
  for (const Load& load : actuations_) apply(load, duration);
  for (const Free& body : free_) {
    body.rigid->setLinearVelocity(body.rigid->getLinearVelocity() + body.acceleration * duration);
  }
  for (const std::size_t body : loaded_links_) {
    apply({body, to_bullet(scene_.bodies()[body].force), btVector3(0, 0, 0)}, duration);
  }
  for (const Load& pull : pulls_) apply(pull, duration);
}

// Where Bullet does not find a point anew, as with two boxes that do not overlap, it keeps the normal of old, however
// far the bodies have turned since. So a normal turns with the body that turned less: with both, if they turn as one;
// with the face, if a round body rolls on it; and not at all on a fixed body.
void Simulation::turn_normals() {
  const auto turn = [this](std::size_t body) {
    return colliders_[body]->getWorldTransform().getBasis() * before_[body].transpose();
  };
  const auto trace = [](const btMatrix3x3& m) { return m[0][0] + m[1][1] + m[2][2]; };
  for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
    btPersistentManifold& manifold = *dispatcher_.getManifoldByIndexInternal(i);
    const std::size_t a = body_of(*manifold.getBody0());
    const std::size_t b = body_of(*manifold.getBody1());
    if (manifold.getNumContacts() == 0 || scene_.bodies()[a].fixed() || scene_.bodies()[b].fixed()) continue;
    const btMatrix3x3 of_a = turn(a);
    const btMatrix3x3 of_b = turn(b);
    const btMatrix3x3& common = trace(of_a) > trace(of_b) ? of_a : of_b;
    for (int j = 0; j < manifold.getNumContacts(); ++j) {
      btVector3& normal = manifold.getContactPoint(j).m_normalWorldOnB;
      normal = (common * normal).normalized();
    }
  }
}

void Simulation::load(std::size_t body, const btVector3& force, const btVector3& torque) {
  loads_.push_back({body, force, torque});
}

void Simulation::actuate(std::size_t body, const btVector3& force, const btVector3& torque) {
  actuations_.push_back({body, force, torque});
}

void Simulation::unload() {
  loads_.clear();
  actuations_.clear();
  if (stepper_) stepper_->motors().clear();
}

void Simulation::drive(std::size_t body, const Vector3& linear, const Vector3& angular, double force, double torque) {
  const Inertial& inertial = inertials_[body];
  const Quaternion axes = from_bullet(colliders_[body]->getWorldTransform().getRotation()) * inertial.axes.conjugate();
  const Vector3 center = axes * inertial.center;
  stepper_->motors().push_back(
      {body, to_bullet(Vector3(linear + angular.cross(center))), to_bullet(angular), force, torque});
}

void Simulation::apply(const Load& load, double duration) {
  if (tree_of_[load.body]) {
    articulation(load.body).apply(static_cast<btMultiBodyLinkCollider&>(*colliders_[load.body]), load.force,
                                  load.torque);
  } else {
    auto& rigid = static_cast<btRigidBody&>(*colliders_[load.body]);
    rigid.applyCentralImpulse(load.force * duration);
    rigid.applyTorqueImpulse(load.torque * duration);
  }
}

void Simulation::set_target(std::size_t joint, double target) {
  for (const auto& articulation : articulations_) articulation->set_target(joint, target);
}

double Simulation::target(std::size_t joint) const {
  for (const auto& articulation : articulations_) {
    if (const auto target = articulation->target(joint)) return *target;
  }
  return scene_.joints()[joint].target;
}

// A damper answers to the speed at the start of a step, before any force of that step: so the pulls are found when the
// step before is over.
void Simulation::find_pulls() {
  pulls_.clear();
  for (std::size_t i = 0; i < spring_ends_.size(); ++i) {
    const Spring& spring = scene_.springs()[i];
    const Span now = span(i);
    if (now.length == 0.0) continue;  // it pulls nowhere
    const double tension = spring.stiffness * (now.length - spring.rest_length) + spring.damping * now.length_rate;
    for_each_pull(i, now, tension, [this](const Load& pull) { pulls_.push_back(pull); });
  }
}

// At its ends that can move.
template <typename Visit>
void Simulation::for_each_pull(std::size_t spring, const Span& now, double tension, const Visit& visit) const {
  const btVector3 pull = now.along * tension;
  const auto [a, b] = spring_ends_[spring];
  for (const auto& [body, end, force] : {std::tuple{a, now.end_a, pull}, std::tuple{b, now.end_b, btVector3(-pull)}}) {
    if (scene_.bodies()[body].fixed()) continue;
    visit(Load{body, force, (end - colliders_[body]->getWorldTransform().getOrigin()).cross(force)});
  }
}

Span Simulation::span(std::size_t spring) const {
  const auto [a, b] = spring_ends_[spring];
  Span span{end_of(a, scene_.springs()[spring].point_a), end_of(b, scene_.springs()[spring].point_b),
            btVector3(0, 0, 0), 0.0};
  span.length = (span.end_b - span.end_a).length();
  if (span.length == 0.0) return span;
  span.along = (span.end_b - span.end_a) / span.length;
  span.length_rate = span.along.dot(velocity(b, span.end_b) - velocity(a, span.end_a));
  return span;
}

btVector3 Simulation::end_of(std::size_t body, const Vector3& point) const {
  return colliders_[body]->getWorldTransform() *
         to_bullet(Vector3(inertials_[body].axes.conjugate() * (point - inertials_[body].center)));
}

btVector3 Simulation::velocity(std::size_t body, const btVector3& point) const {
  if (tree_of_[body]) {
    return articulation(body).velocity(static_cast<const btMultiBodyLinkCollider&>(*colliders_[body]), point);
  }
  const auto& rigid = static_cast<const btRigidBody&>(*colliders_[body]);
  return rigid.getVelocityInLocalPoint(point - rigid.getCenterOfMassPosition());
}

std::vector<Contact> Simulation::contacts() const {
  std::vector<Contact> contacts;
  const double duration = last_duration_ > 0.0 ? last_duration_ : step_;
  for (int i = 0; i < dispatcher_.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher_.getManifoldByIndexInternal(i);
    const Body& a = scene_.bodies()[body_of(*manifold->getBody0())];
    const Body& b = scene_.bodies()[body_of(*manifold->getBody1())];
    for (int j = 0; j < manifold->getNumContacts(); ++j) {
      const btManifoldPoint& point = manifold->getContactPoint(j);
      const btVector3 tangential = (point.m_lateralFrictionDir1 * point.m_appliedImpulseLateral1 +
                                    point.m_lateralFrictionDir2 * point.m_appliedImpulseLateral2) /
                                   duration;
      contacts.push_back({a.name, b.name, from_bullet(point.getPositionWorldOnB()), from_bullet(point.m_normalWorldOnB),
                          point.getDistance(), point.getAppliedImpulse() / duration, from_bullet(tangential),
                          a.friction * b.friction});
    }
  }
  return contacts;
}

PairPoints Simulation::pair(std::size_t a, std::size_t b, double reach) {
  PairPoints points(*colliders_[a], reach);
  hull_contacts_.tilted = false;  // points of tilted bodies are not exact; Bullet has others for two single solids
  world_.contactPairTest(colliders_[a], colliders_[b], points);
  hull_contacts_.tilted = true;
  return points;
}

bool Simulation::can_collide(std::size_t a, std::size_t b) const {
  return !(scene_.bodies()[a].fixed() && scene_.bodies()[b].fixed()) && !separate_.contains(a, b);
}

}  // namespace energymargin
