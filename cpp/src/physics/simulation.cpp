#include "physics/simulation.hpp"

#include <algorithm>
#include <cmath>

#include "base/check.hpp"

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

// What goes along slides along others that it comes closer to by less than this share of its way.
constexpr double along_share = 1e-3;

struct Carriers {
  const Scene& scene;
  const MovingBodies& bodies;
  const std::vector<Velocity>& ways;
  std::vector<int> of{};  // each body, or the base of its tree; -1: none
  bool changed = false;

  bool kinematic(std::size_t body) const { return scene.bodies()[body].kinematic; }
  const btVector3& origin(std::size_t body) const { return bodies.poses()[body].getOrigin(); }

  void join(std::size_t from, std::size_t to) {
    if (of[from] < 0 || of[to] >= 0 || scene.bodies()[to].fixed()) return;
    of[to] = of[from];
    changed = true;
  }

  void stop(std::size_t body) {
    if (of[body] < 0 || kinematic(body)) return;
    of[body] = -1;
    changed = true;
  }

  btVector3 velocity(std::size_t body, const btVector3& point) const {
    if (of[body] < 0) return {0, 0, 0};
    const auto carrier = static_cast<std::size_t>(of[body]);
    return ways[carrier].linear + ways[carrier].angular.cross(point - origin(carrier));
  }

  // Whether what is carried would be carried into something at a point: then it stays.
  bool blocks(std::size_t a, std::size_t b, const ContactPoint& point) const {
    if (of[a] == of[b]) return false;
    const btVector3 apart = velocity(a, point.on_a) - velocity(b, point.on_b);
    return point.normal.dot(apart) < -along_share * apart.length();
  }
};

// A kinematic body loses no time. What it touches, or what touches that, goes along with it for `lost` [s]: it pushes,
// and passes only what something else holds. Each body has at most one carrier. `ways` are the velocities of all
// bodies.
void carry_along(const Scene& scene, MovingBodies& bodies, const std::vector<ContactPoint>& points,
                 const std::vector<Velocity>& ways, double lost) {
  Carriers carriers{scene, bodies, ways};
  const std::size_t count = scene.bodies().size();
  for (std::size_t i = 0; i < count; ++i) carriers.of.push_back(carriers.kinematic(i) ? static_cast<int>(i) : -1);
  const auto until_nothing_changes = [&](const auto& visit) {
    do {
      carriers.changed = false;
      for (const ContactPoint& point : points) visit(point, bodies.base_of(point.a), bodies.base_of(point.b));
    } while (carriers.changed);
  };
  until_nothing_changes([&](const ContactPoint&, std::size_t a, std::size_t b) {
    carriers.join(a, b);
    carriers.join(b, a);
  });
  until_nothing_changes([&](const ContactPoint& point, std::size_t a, std::size_t b) {
    if (!carriers.blocks(a, b, point)) return;
    if (!carriers.kinematic(b)) carriers.stop(a);
    if (!carriers.kinematic(a)) carriers.stop(b);
  });
  for (std::size_t i = 0; i < count; ++i) {
    if (carriers.of[i] < 0 || carriers.kinematic(i)) continue;
    const auto carrier = static_cast<std::size_t>(carriers.of[i]);
    bodies.carry(i, ways[carrier], carriers.origin(carrier), lost);
  }
}

}  // namespace

Simulation::Simulation(const Scene& scene)
    : scene_(scene),
      objects_(scene.with_role(Role::object)),
      layout_(scene),
      step_(scene.stepping().step),
      bodies_(scene_),
      pairs_(scene_, bodies_.poses()),
      equations_(scene_, bodies_),
      springs_(scene_, bodies_),
      ways_(scene.bodies().size()) {}

int Simulation::whole_steps(double duration) const { return static_cast<int>(std::lround(duration / step_)); }

LoadedMotion Simulation::before(const Load& load) const {
  if (const FreeBody* free = bodies_.free(load.body)) return {free->velocity};
  const auto [index, link] = *bodies_.link(load.body);
  const Articulation& tree = *bodies_.trees()[index];
  const btVector3 arm = bodies_.poses()[load.body].getOrigin() - tree.origin();
  LoadedMotion motion;
  motion.along.resize(tree.count());
  tree.add(link, {load.torque + arm.cross(load.force), load.force}, motion.along.data());
  for (std::size_t i = 0; i < tree.count(); ++i) motion.power += motion.along[i] * tree.velocities()[i];
  return motion;
}

double Simulation::power(const Load& load, const LoadedMotion& before) const {
  if (const FreeBody* free = bodies_.free(load.body)) return load.power(before.of_body, free->pushed);
  const std::vector<double>& pushed = equations_.pushed(bodies_.link(load.body)->tree);
  double power = before.power;
  for (std::size_t i = 0; i < pushed.size(); ++i) power += before.along[i] * pushed[i];
  return 0.5 * power;
}

void Simulation::restore(const State& state) {
  bodies_.restore(state);
  pairs_.forget();
  last_duration_ = 0.0;
  unload();
  spring_loads_ = springs_.loads(true);
}

void Simulation::read(State& state) const {
  state.resize(layout_.dimension());
  bodies_.read(state);
  if (!state.allFinite()) throw Diverged("a state");
}

void Simulation::read(Motion& motion) const {
  const btVector3 none(0, 0, 0);
  motion.bodies.assign(scene_.bodies().size(), {{}, none, none});
  bodies_.read(motion);
  for (const Load& load : springs_.loads(false)) {
    motion.bodies[load.body].force += load.force;
    motion.bodies[load.body].torque += load.torque;
  }
}

void Simulation::read(std::vector<Velocity>& velocities) const {
  velocities.resize(scene_.bodies().size());
  bodies_.read(velocities);
}

// A substep's length is known once its velocities are: if bodies would pass into each other, it is done again, as short
// as they are safe.
SubstepResult Simulation::advance(double duration, int substeps) {
  load_bodies();
  pairs_.update();
  if (substeps < most_substeps) duration = equations_.until_bounce(pairs_.points(), duration);
  for (int tries = 1;; ++tries) {
    const Substep substep{duration, pairs_.points(), motors_};
    const bool converged = equations_.solve(substep);
    bodies_.read_ways(ways_);
    const double share = pairs_.safe_share(ways_, duration);
    const double shorter = duration * (share * duration > shortest_substep * step_ ? share : blocked_share);
    if (share < 1.0 && tries < most_tries && substeps < most_substeps && shorter > shortest_substep * step_) {
      duration = shorter;
      continue;
    }
    equations_.commit(substep, share);
    bodies_.move(duration, share);
    const double lost = (1.0 - share) * duration;
    if (share < 1.0) carry_along(scene_, bodies_, pairs_.points(), ways_, lost);
    last_duration_ = duration;
    spring_loads_ = springs_.loads(true);
    return {duration, lost, converged};
  }
}

void Simulation::load_bodies() {
  bodies_.clear_loads();
  for (const std::vector<Load>* loads :
       {&std::as_const(loads_), &std::as_const(actuations_), &std::as_const(spring_loads_)}) {
    for (const Load& load : *loads) bodies_.apply(load);
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
  const Quaternion orientation = from_bullet(bodies_.poses()[body].getRotation()) * inertial.axes.conjugate();
  const Vector3 center = orientation * inertial.center;
  const Vector3 of_center = linear + angular.cross(center);
  motors_.push_back({body, {to_bullet(of_center), to_bullet(angular)}, force, torque});
}

std::vector<Contact> Simulation::contacts() const {
  const double duration = last_duration_ > 0.0 ? last_duration_ : step_;
  std::vector<Contact> contacts;
  for (const ContactPoint& point : pairs_.points()) {
    contacts.push_back({scene_.bodies()[point.a].name, scene_.bodies()[point.b].name, from_bullet(point.on_b),
                        from_bullet(point.normal), point.distance, point.normal_impulse / duration,
                        from_bullet(point.friction_impulse / duration), scene_.contact_friction(point.a, point.b)});
  }
  return contacts;
}

}  // namespace energymargin
