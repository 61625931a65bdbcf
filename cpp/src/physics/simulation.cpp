#include "physics/simulation.hpp"

#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "physics/articulated/articulated_bodies.hpp"
#include "physics/contacts/contact_points.hpp"
#include "physics/free_bodies/free_bodies.hpp"

namespace energymargin {
namespace {

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

// Rounds over the joints' rows in each of the solver's. Where a follower is heavier than what it follows, as its
// multiplier makes it, one row undoes most of what the other did, and they need many.
constexpr int mimic_rounds = 10;

std::unique_ptr<Stepper> make_stepper(const Scene& scene, const std::vector<CollisionShape>& shapes) {
  if (scene.joints().empty()) return std::make_unique<FreeBodies>(scene, shapes);
  return std::make_unique<ArticulatedBodies>(scene, shapes);
}

}  // namespace

btContactSolverInfo solver_settings(const Scene& scene) {
  const Stepping& stepping = scene.stepping();
  const auto& joints = scene.joints();
  btContactSolverInfo info;
  info.m_numIterations = stepping.iterations;
  info.m_leastSquaresResidualThreshold = stepping.tolerance;
  if (stepping.friction_directions == 2) info.m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  info.m_solverMode |= SOLVER_USE_ARTICULATED_WARMSTARTING;
  info.m_articulatedWarmstartingFactor = 1.0;
  info.m_warmstartingFactor = 1.0;
  // Penetration recovery by split impulses changes positions and not velocities: no energy out of nothing.
  info.m_splitImpulse = 1;
  info.m_splitImpulsePenetrationThreshold = 0.0;
  const bool mimics = std::any_of(joints.begin(), joints.end(), [](const Joint& joint) { return joint.mimic; });
  if (mimics) info.m_numNonContactInnerIterations = mimic_rounds;
  return info;
}

Simulation::Simulation(const Scene& scene, Detection detection)
    : scene_(scene),
      layout_(scene),
      step_(scene.stepping().step),
      shapes_(collision_shapes(scene)),
      filter_(scene_),
      pair_query_(dispatcher_),
      stepper_(make_stepper(scene_, shapes_)),
      pairs_(dispatcher_.bullet(), filter_, stepper_->colliders()),
      springs_(scene_, *stepper_),
      solver_(solver_settings(scene)),
      axes_before_(scene.bodies().size()),
      velocities_(scene.bodies().size()) {
  for (const Body& body : scene.bodies()) inertials_.push_back(body.principal_inertial());
  if (detection == Detection::continuous) continuous_.emplace(shapes_, stepper_->colliders());
}

int Simulation::whole_steps(double duration) const { return static_cast<int>(std::lround(duration / step_)); }

const std::vector<btRigidBody*>& Simulation::objects() const {
  if (stepper_->objects().empty()) {
    reject("scene", "without a free object", "a body of role \"object\" that is on no joint");
  }
  return stepper_->objects();
}

void Simulation::restore(const State& state) {
  stepper_->restore(state);
  pairs_.forget();
  last_duration_ = 0.0;
  unload();
  springs_.update();
}

void Simulation::read(State& state) const {
  state.resize(layout_.dimension());
  stepper_->read(state);
  if (!state.allFinite()) throw Diverged("a state");
}

void Simulation::read(Motion& motion) const {
  const btVector3 none(0, 0, 0);
  motion.bodies.assign(scene_.bodies().size(), {none, none, none, none});
  stepper_->read(motion);
  springs_.add_stiffness(motion);
}

void Simulation::read(std::vector<Velocity>& velocities) const {
  velocities.resize(scene_.bodies().size());
  stepper_->read(velocities);
}

PartResult Simulation::step() {
  PartResult whole{step_, 0.0, true};
  double left = step_;
  for (int parts = 0; left > 0.0; ++parts) {
    const PartResult part = advance(left, parts);
    left -= part.duration;
    whole.lost += part.lost;
    whole.converged = whole.converged && part.converged;
  }
  return whole;
}

PartResult Simulation::advance(double duration, int parts) {
  for (std::size_t i = 0; i < axes_before_.size(); ++i) axes_before_[i] = collider(i).getWorldTransform().getBasis();
  const PartResult part = advance_safely(duration, parts);
  turn_normals(dispatcher_.bullet(), axes_before_);
  springs_.update();
  return part;
}

// A part's length is known once its velocities are: if bodies would pass into each other, it is done again, as short as
// they are safe.
PartResult Simulation::advance_safely(double duration, int parts) {
  stepper_->save();
  const ImpulseWork work = impulse_work();
  for (int tries = 1;; ++tries) {
    accelerate(duration);
    if (tries == 1) pairs_.update();
    const bool converged = solve(duration);
    // Split impulses know nothing of links.
    if (continuous_ && !scene_.joints().empty() && continuous_->is_squeezed(pairs_)) stepper_->undo_split_impulses();
    const double share = continuous_ ? safe_share(duration) : 1.0;
    const double shorter = duration * (share * duration > shortest_part * step_ ? share : blocked_share);
    if (share < 1.0 && tries < most_tries && parts < most_parts && shorter > shortest_part * step_) {
      stepper_->undo();
      stepper_->impulses().work = work;
      duration = shorter;
      continue;
    }
    stepper_->move(duration, share);
    return {duration, (1.0 - share) * duration, converged};
  }
}

// Gravity enters as a change of velocity before the step, as wrenches do: Bullet aims friction against the velocity it
// finds, and so it acts against what the forces are about to do, also on a body at rest.
void Simulation::accelerate(double duration) {
  for (const Load& load : loads_) stepper_->apply(load, duration);
  for (const Load& load : actuations_) stepper_->apply(load, duration);
  stepper_->accelerate(duration);
  for (const Load& load : springs_.loads()) stepper_->apply(load, duration);
}

bool Simulation::solve(double duration) {
  // The solver starts from the impulses of the last part. If that was longer, so are they; if it was shorter, they may
  // be of an impact, which does not grow with time.
  solver_.m_warmstartingFactor = last_duration_ > 0.0 ? std::min(1.0, duration / last_duration_) : 1.0;
  solver_.m_articulatedWarmstartingFactor = solver_.m_warmstartingFactor;
  // Of an overlap, and of a mimic's error, the share that is put right in this part: links are moved out by a velocity,
  // which would have no bound in short parts.
  solver_.m_erp2 = error_share * (duration / step_);
  solver_.m_timeStep = duration;
  last_duration_ = duration;
  return stepper_->solve({duration, pairs_.touching(), motors_, solver_});
}

double Simulation::safe_share(double duration) {
  stepper_->read(velocities_);
  return continuous_->safe_share(pairs_, velocities_, duration);
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
  motors_.clear();
}

void Simulation::add_motor(std::size_t body, const Vector3& linear, const Vector3& angular, double force,
                           double torque) {
  const Inertial& inertial = inertials_[body];
  const Quaternion orientation =
      from_bullet(collider(body).getWorldTransform().getRotation()) * inertial.axes.conjugate();
  const Vector3 center = orientation * inertial.center;
  motors_.push_back({body, to_bullet(Vector3(linear + angular.cross(center))), to_bullet(angular), force, torque});
}

std::vector<Contact> Simulation::contacts() const {
  return contact_points(dispatcher_.bullet(), scene_, last_duration_ > 0.0 ? last_duration_ : step_);
}

ClosestPoints Simulation::closest_points(std::size_t a, std::size_t b, double reach) {
  return pair_query_(*stepper_->colliders()[a], *stepper_->colliders()[b], reach);
}

}  // namespace energymargin
