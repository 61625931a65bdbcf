#include "physics/simulation.hpp"

#include <algorithm>
#include <cmath>

#include "base/check.hpp"
#include "physics/carriers.hpp"

namespace energymargin {
namespace {

// Substeps in which bodies come into contact with each other; the rest of the step is lost then, and nothing moves.
constexpr int most_substeps = 8;

// So many lengths of a substep are tried to find the one that ends in contact.
constexpr int most_tries = 4;

// A substep that would be shorter than this share of a step is not tried: bodies are in contact already. If they turn
// into each other, one of this share of the one before may be short enough for penetration recovery.
constexpr double shortest_substep = 1e-4;
constexpr double blocked_share = 0.25;

}  // namespace

Simulation::Simulation(const Scene& scene)
    : scene_(scene),
      layout_(scene),
      step_(scene.stepping().step),
      placement_(scene_),
      equations_(scene_, placement_.bodies, impulses_),
      springs_(scene_, placement_.bodies),
      ways_(scene.bodies().size()) {}

int Simulation::whole_steps(double duration) const { return static_cast<int>(std::lround(duration / step_)); }

const std::vector<btRigidBody*>& Simulation::objects() const {
  const std::vector<btRigidBody*>& objects = placement_.bodies.objects();
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
  placement_.bodies.read(state);
  if (!state.allFinite()) throw Diverged("a state");
}

void Simulation::read(Motion& motion) const {
  const btVector3 none(0, 0, 0);
  motion.bodies.assign(scene_.bodies().size(), {none, none, none, none});
  placement_.bodies.read(motion);
  springs_.add_stiffness(motion);
}

void Simulation::read(std::vector<Velocity>& velocities) const {
  velocities.resize(scene_.bodies().size());
  placement_.bodies.read(velocities);
}

// A substep's length is known once its velocities are: if bodies would pass into each other, it is done again, as short
// as they are safe.
SubstepResult Simulation::advance(double duration, int substeps) {
  load_bodies();
  CollisionPairs& pairs = placement_.pairs;
  pairs.update();
  const Stepping& stepping = scene_.stepping();
  for (int tries = 1;; ++tries) {
    const Substep substep{duration, step_, pairs.points(), motors_, stepping.iterations, stepping.tolerance};
    const bool converged = equations_.solve(substep);
    placement_.bodies.read_ways(ways_);
    const double share = pairs.safe_share(ways_, duration);
    const double shorter = duration * (share * duration > shortest_substep * step_ ? share : blocked_share);
    if (share < 1.0 && tries < most_tries && substeps < most_substeps && shorter > shortest_substep * step_) {
      duration = shorter;
      continue;
    }
    equations_.commit(substep, share);
    placement_.bodies.move(duration, share);
    const double lost = (1.0 - share) * duration;
    if (share < 1.0) carry_along(scene_, placement_.bodies, pairs.points(), ways_, lost);
    last_duration_ = duration;
    springs_.update();
    return {duration, lost, converged};
  }
}

void Simulation::load_bodies() {
  placement_.bodies.clear_loads();
  for (const std::vector<Load>* loads : {&std::as_const(loads_), &std::as_const(actuations_), &springs_.loads()}) {
    for (const Load& load : *loads) placement_.bodies.apply(load);
  }
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
  const double duration = last_duration_ > 0.0 ? last_duration_ : step_;
  std::vector<Contact> contacts;
  for (const ContactPoint& point : placement_.pairs.points()) {
    contacts.push_back({scene_.bodies()[point.a].name, scene_.bodies()[point.b].name, from_bullet(point.on_b),
                        from_bullet(point.normal), point.distance, point.normal_impulse / duration,
                        from_bullet(point.friction_impulse / duration), scene_.contact_friction(point.a, point.b)});
  }
  return contacts;
}

}  // namespace energymargin
