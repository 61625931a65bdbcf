#include "physics/simulation.hpp"

#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "physics/contacts/contact_points.hpp"

namespace energymargin {
namespace {

// Parts of a step in which bodies come into contact with each other; the rest of it is lost then, and nothing moves.
constexpr int most_parts = 8;

// Of a part's length it is tried to find the one that ends in contact.
constexpr int most_tries = 4;

// A part that would be shorter than this share of a step is not tried: bodies are in contact already. If they turn into
// each other, a part of this share of the one before may be short enough for penetration recovery.
constexpr double shortest_part = 1e-4;
constexpr double blocked_share = 0.25;

}  // namespace

Simulation::Simulation(const Scene& scene, Detection detection)
    : scene_(scene),
      layout_(scene),
      step_(scene.stepping().step),
      shapes_(collision_shapes(scene)),
      filter_(scene_),
      pair_query_(dispatcher_),
      bodies_(scene_, shapes_),
      equations_(scene_, bodies_, impulses_),
      pairs_(dispatcher_.bullet(), filter_, bodies_.colliders()),
      springs_(scene_, bodies_),
      carriers_(scene_, bodies_),
      ways_(scene.bodies().size()) {
  for (const Body& body : scene.bodies()) inertials_.push_back(body.principal_inertial());
  if (detection == Detection::continuous) continuous_.emplace(shapes_, bodies_.colliders());
}

int Simulation::whole_steps(double duration) const { return static_cast<int>(std::lround(duration / step_)); }

const std::vector<btRigidBody*>& Simulation::objects() const {
  if (bodies_.objects().empty()) {
    reject("scene", "without a free object", "a body of role \"object\" that is on no joint");
  }
  return bodies_.objects();
}

void Simulation::restore(const State& state) {
  bodies_.restore(state);
  pairs_.forget();
  last_duration_ = 0.0;
  unload();
  springs_.update();
}

void Simulation::read(State& state) const {
  state.resize(layout_.dimension());
  bodies_.read(state);
  if (!state.allFinite()) throw Diverged("a state");
}

void Simulation::read(Motion& motion) const {
  const btVector3 none(0, 0, 0);
  motion.bodies.assign(scene_.bodies().size(), {none, none, none, none});
  bodies_.read(motion);
  springs_.add_stiffness(motion);
}

void Simulation::read(std::vector<Velocity>& velocities) const {
  velocities.resize(scene_.bodies().size());
  bodies_.read(velocities);
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
  const PartResult part = advance_safely(duration, parts);
  springs_.update();
  return part;
}

// A part's length is known once its velocities are: if bodies would pass into each other, it is done again, as short as
// they are safe.
PartResult Simulation::advance_safely(double duration, int parts) {
  load_bodies();
  pairs_.update();
  const Stepping& stepping = scene_.stepping();
  for (int tries = 1;; ++tries) {
    const StepPart part{duration, step_, pairs_.points(), motors_, stepping.iterations, stepping.tolerance};
    const bool converged = equations_.solve(part);
    const double share = continuous_ ? safe_share(duration) : 1.0;
    const double shorter = duration * (share * duration > shortest_part * step_ ? share : blocked_share);
    if (share < 1.0 && tries < most_tries && parts < most_parts && shorter > shortest_part * step_) {
      duration = shorter;
      continue;
    }
    equations_.commit(part, share);
    bodies_.move(duration, share);
    if (share < 1.0) carriers_.carry(pairs_.points(), ways_, (1.0 - share) * duration);
    last_duration_ = duration;
    return {duration, (1.0 - share) * duration, converged};
  }
}

void Simulation::load_bodies() {
  bodies_.clear_loads();
  for (const Load& load : loads_) bodies_.apply(load);
  for (const Load& load : actuations_) bodies_.apply(load);
  for (const Load& load : springs_.loads()) bodies_.apply(load);
}

double Simulation::safe_share(double duration) {
  bodies_.read_ways(ways_);
  return continuous_->safe_share(pairs_, ways_, duration);
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
  return contact_points(pairs_.points(), scene_, last_duration_ > 0.0 ? last_duration_ : step_);
}

ClosestPoints Simulation::closest_points(std::size_t a, std::size_t b, double reach) {
  return pair_query_(*bodies_.colliders()[a], *bodies_.colliders()[b], reach);
}

}  // namespace energymargin
