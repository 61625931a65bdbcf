#include "physics/simulation.hpp"

#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "physics/contacts/contact_points.hpp"

namespace energymargin {
namespace {

// Parts of a step in which bodies come into contact with each other; the rest of it is lost then, and nothing moves.
constexpr int most_parts = 8;

// So many lengths of a part are tried to find the one that ends in contact.
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
      placement_(scene_),
      equations_(scene_, bodies(), impulses_),
      springs_(scene_, bodies()),
      carriers_(scene_, bodies()),
      ways_(scene.bodies().size()) {
  if (detection == Detection::continuous) continuous_.emplace(scene_, bodies().colliders());
}

int Simulation::whole_steps(double duration) const { return static_cast<int>(std::lround(duration / step_)); }

const std::vector<btRigidBody*>& Simulation::objects() const {
  const std::vector<btRigidBody*>& objects = placement_.bodies().objects();
  if (objects.empty()) reject("scene", "without a free object", "a body of role \"object\" that is on no joint");
  return objects;
}

void Simulation::restore(const State& state) {
  placement_.restore(state);
  last_duration_ = 0.0;
  unload();
  springs_.update();
}

void Simulation::read(State& state) const {
  state.resize(layout_.dimension());
  placement_.bodies().read(state);
  if (!state.allFinite()) throw Diverged("a state");
}

void Simulation::read(Motion& motion) const {
  const btVector3 none(0, 0, 0);
  motion.bodies.assign(scene_.bodies().size(), {none, none, none, none});
  placement_.bodies().read(motion);
  springs_.add_stiffness(motion);
}

void Simulation::read(std::vector<Velocity>& velocities) const {
  velocities.resize(scene_.bodies().size());
  placement_.bodies().read(velocities);
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

// A part's length is known once its velocities are: if bodies would pass into each other, it is done again, as short as
// they are safe.
PartResult Simulation::advance(double duration, int parts) {
  load_bodies();
  CollisionPairs& pairs = placement_.pairs();
  pairs.update();
  const Stepping& stepping = scene_.stepping();
  for (int tries = 1;; ++tries) {
    const StepPart part{duration, step_, pairs.points(), motors_, stepping.iterations, stepping.tolerance};
    const bool converged = equations_.solve(part);
    const double share = continuous_ ? safe_share(duration) : 1.0;
    const double shorter = duration * (share * duration > shortest_part * step_ ? share : blocked_share);
    if (share < 1.0 && tries < most_tries && parts < most_parts && shorter > shortest_part * step_) {
      duration = shorter;
      continue;
    }
    equations_.commit(part, share);
    bodies().move(duration, share);
    if (share < 1.0) carriers_.carry(pairs.points(), ways_, (1.0 - share) * duration);
    last_duration_ = duration;
    springs_.update();
    return {duration, (1.0 - share) * duration, converged};
  }
}

void Simulation::load_bodies() {
  bodies().clear_loads();
  for (const Load& load : loads_) bodies().apply(load);
  for (const Load& load : actuations_) bodies().apply(load);
  for (const Load& load : springs_.loads()) bodies().apply(load);
}

double Simulation::safe_share(double duration) {
  bodies().read_ways(ways_);
  return continuous_->safe_share(placement_.pairs(), ways_, duration);
}

void Simulation::unload() {
  loads_.clear();
  actuations_.clear();
  motors_.clear();
}

void Simulation::add_motor(std::size_t body, const Vector3& linear, const Vector3& angular, double force,
                           double torque) {
  const Inertial& inertial = scene_.inertial(body);
  const Quaternion orientation =
      from_bullet(placement_.collider(body).getWorldTransform().getRotation()) * inertial.axes.conjugate();
  const Vector3 center = orientation * inertial.center;
  motors_.push_back({body, to_bullet(Vector3(linear + angular.cross(center))), to_bullet(angular), force, torque});
}

std::vector<Contact> Simulation::contacts() const {
  return contact_points(placement_.pairs().points(), scene_, last_duration_ > 0.0 ? last_duration_ : step_);
}

}  // namespace energymargin
