#pragma once
// A Scene in Bullet.

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/check.hpp"
#include "energymargin/world.hpp"
#include "physics/contacts/collision_pairs.hpp"
#include "physics/solver/step_equations.hpp"
#include "physics/springs.hpp"

namespace energymargin {
//! Bodies that carry others along, and those that they carry.
struct Carriers {
  // What goes along slides along others that it comes closer to by less than this share of its way.
  static constexpr double along_share = 1e-3;

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

//! A kinematic body loses no time. What it touches, or what touches that, goes along with it for `lost` [s]: it passes
//! only what something else holds. Each body has at most one carrier. `ways` are all bodies' velocities.
inline void carry_along(const Scene& scene, MovingBodies& bodies, const std::vector<ContactPoint>& points,
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

//! What became of a substep.
struct SubstepResult {
  double duration;  // [s]
  double lost;      // of it, in which nothing moved by itself [s]
  bool converged;   // whether the velocities satisfy their equations
};

//! How a loaded body moves: of a link, its tree along what the load is of the tree's velocities.
struct LoadedMotion {
  Velocity of_body{};
  std::vector<double> along{};
  double power = 0.0;  // [W]
};

//! Bullet's side of a World. What makes rollouts pure functions is `restore`.
class Simulation {
 public:
  explicit Simulation(const Scene& scene)
      : scene_(scene),
        objects_(scene.with_role(Role::object)),
        layout_(scene),
        step_(scene.stepping().step),
        bodies_(scene_),
        pairs_(scene_, bodies_.poses()),
        equations_(scene_, bodies_),
        springs_(scene_, bodies_),
        ways_(scene.bodies().size()) {}
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  const Scene& scene() const { return scene_; }
  const StateLayout& layout() const { return layout_; }
  int whole_steps(double duration) const { return static_cast<int>(std::lround(duration / step_)); }

  //! Bodies of role "object", in the scene's order.
  const std::vector<std::size_t>& objects() const { return objects_; }

  //! Sets anew everything that could carry the past into the next rollout.
  void restore(const State& state) {
    bodies_.restore(state);
    state_ = state.head(layout_.dimension());
    in_step_ = false;
    substeps_ = touches_ = blows_ = 0;
    pairs_.forget();
    last_duration_ = 0.0;
    unload();
    spring_loads_ = springs_.loads(true);
  }

  //! Throws Diverged if the state is not finite.
  void read(State& state) const {
    state = state_;
    if (in_step_) bodies_.read(state);
    if (!state.allFinite()) throw Diverged("a state");
  }
  void read(Motion& motion) const {
    const btVector3 none(0, 0, 0);
    motion.bodies.assign(scene_.bodies().size(), {{}, none, none});
    bodies_.read(motion);
    for (const Load& load : springs_.loads(false)) {
      motion.bodies[load.body].force += load.force;
      motion.bodies[load.body].torque += load.torque;
    }
  }
  void read(std::vector<Velocity>& velocities) const {
    velocities.resize(scene_.bodies().size());
    bodies_.read(velocities);
  }

  //! What acts until `unload`; the loads of the robot's plan are listed on their own.
  void load(const Load& load) { loads_.push_back(load); }
  void actuate(const Load& load) { actuations_.push_back(load); }
  void unload() {
    loads_.clear();
    actuations_.clear();
    motors_.clear();
  }
  const std::vector<Load>& actuations() const { return actuations_; }

  //! A motor of limited force [N] and torque [N m] keeps a free body at the velocities of its frame, until `unload`.
  void add_motor(std::size_t body, const Vector3& linear, const Vector3& angular, double force, double torque) {
    const Inertial& inertial = scene_.inertial(body);
    const Quaternion orientation = from_bullet(bodies_.poses()[body].getRotation()) * inertial.axes.conjugate();
    const Vector3 center = orientation * inertial.center;
    const Vector3 of_center = linear + angular.cross(center);
    motors_.push_back({body, {to_bullet(of_center), to_bullet(angular)}, force, torque});
  }

  //! The target of a joint or, beyond all joints, a tendon, until `restore`.
  void set_target(std::size_t index, double target) { bodies_.set_target(index, target); }
  double target(std::size_t index) { return bodies_.target(index); }

  //! Goes on by what is left of a step [s], or by less where bodies come into contact on the way: in no time at all
  //! where some bounce. After too many substeps the rest is lost: velocities change, and nothing moves further than
  //! into contact.
  SubstepResult advance(double left) {
    load_bodies();
    equations_.drive(motors_);
    bodies_.read(ways_);
    pairs_.update(ways_, left);
    const bool may_bounce = blows_ < most_blows;
    if (may_bounce && equations_.find_blow(pairs_.points())) return blow();
    double duration = touches_ < most_touches ? std::min(left, pairs_.until_touch()) : left;
    if (duration < left) ++touches_;
    duration = equations_.until_turned(duration, shortest_turn * step_);
    const bool turned = equations_.turns_too_far(duration);
    const int substeps = substeps_++;
    for (int tries = 1;; ++tries) {
      const Substep substep{duration, pairs_.points(), motors_, may_bounce ? Bounces::later : Bounces::never};
      const bool converged = equations_.solve(substep);
      bodies_.read_ways(ways_);
      const double share = pairs_.safe_share(ways_, duration);
      if (share < 1.0 && tries == 1 && pairs_.add_blocking()) continue;
      const double shorter = duration * (share * duration > shortest_substep * step_ ? share : blocked_share);
      if (share < 1.0 && tries < most_tries && substeps < most_substeps && shorter > shortest_substep * step_) {
        duration = shorter;
        continue;
      }
      equations_.commit(substep, share);
      bodies_.move(duration, share);
      const double lost = (1.0 - share) * duration;
      if (share < 1.0) carry_along(scene_, bodies_, pairs_.points(), ways_, lost);
      equations_.join_velocities(duration);
      in_step_ = duration < left;
      if (!in_step_) settle();
      last_duration_ = duration;
      spring_loads_ = springs_.loads(true);
      return {duration, lost, converged && !turned};
    }
  }

  const Springs& springs() const { return springs_; }
  const std::vector<Load>& spring_loads() const { return spring_loads_; }

  //! Sums up the work of the impulses in the next steps, while that has a motion to begin with.
  ImpulseAudit& impulses() { return equations_.audit; }

  //! What a load acts on, as a substep begins.
  LoadedMotion before(const Load& load) const {
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

  //! Mean power of a load in the last substep, from what it was before to after its impulses and before it coasted: the
  //! work on a free body is exactly its gain of kinetic energy [W].
  double power(const Load& load, const LoadedMotion& before) const {
    if (const FreeBody* free = bodies_.free(load.body)) return load.power(before.of_body, free->pushed);
    const std::vector<double>& pushed = equations_.pushed(bodies_.link(load.body)->tree);
    double power = before.power;
    for (std::size_t i = 0; i < pushed.size(); ++i) power += before.along[i] * pushed[i];
    return 0.5 * power;
  }

  //! They have the forces of the last substep.
  std::vector<Contact> contacts() const {
    const double duration = last_duration_ > 0.0 ? last_duration_ : step_;
    std::vector<Contact> contacts;
    for (const ContactPoint& point : pairs_.points()) {
      if (!pairs_.touches(point)) continue;
      contacts.push_back({scene_.bodies()[point.a].name, scene_.bodies()[point.b].name, from_bullet(point.on_b),
                          from_bullet(point.normal), point.distance, point.normal_impulse / duration,
                          from_bullet(point.friction_impulse / duration), scene_.contact_friction(point.a, point.b)});
    }
    return contacts;
  }

  //! Sum of the normal forces between two bodies in the last substep [N].
  double normal_force(std::size_t a, std::size_t b) const {
    double impulse = 0.0;
    for (const ContactPoint& point : pairs_.points()) {
      if (std::minmax(point.a, point.b) == std::minmax(a, b)) impulse += point.normal_impulse;
    }
    return impulse / (last_duration_ > 0.0 ? last_duration_ : step_);
  }

  //! The bodies where the last `restore` or `advance` left them.
  const CollisionPairs& pairs() const { return pairs_; }

 private:
  // Substeps in which bodies come into contact with each other; the rest of the step is lost then, and nothing moves.
  static constexpr int most_substeps = 32;
  static constexpr int most_tries = 4;  // of lengths of a substep, to find the one that ends in contact

  // Substeps that end where bodies touch; then gaps close along the normals of now. Blows; then nothing bounces.
  static constexpr int most_touches = 24, most_blows = 96;

  // A substep that would be shorter than this share of a step is not tried: bodies are in contact already. If they turn
  // into each other, one of this share of the one before may be short enough for penetration recovery.
  static constexpr double shortest_substep = 1e-4;
  static constexpr double blocked_share = 0.25;

  // What turns fast in a loop asks for substeps, but for none shorter than this share of a step.
  static constexpr double shortest_turn = 1.0 / 16.0;

  static constexpr double blow_duration = 1e-6;  // of a step: its loads and ways count nothing

  // Each step begins with the numbers of a state, be it the first one of a rollout or not.
  void settle() {
    bodies_.read(state_);
    bodies_.put(state_);
    substeps_ = touches_ = blows_ = 0;
  }

  // What bounces and touches parts.
  SubstepResult blow() {
    const Substep substep{blow_duration * step_, pairs_.points(), motors_, Bounces::now};
    const bool converged = equations_.solve(substep);
    equations_.commit(substep, 1.0);
    equations_.join_velocities(0.0);
    in_step_ = true;
    ++blows_;
    spring_loads_ = springs_.loads(true);
    return {0.0, 0.0, converged};
  }

  void load_bodies() {
    bodies_.clear_loads();
    for (const std::vector<Load>* loads :
         {&std::as_const(loads_), &std::as_const(actuations_), &std::as_const(spring_loads_)}) {
      for (const Load& load : *loads) bodies_.apply(load);
    }
  }

  Scene scene_;
  std::vector<std::size_t> objects_;
  StateLayout layout_;
  double step_;
  State state_;                                 // at the end of the last step
  bool in_step_ = false;                        // the bodies are further
  int substeps_ = 0, touches_ = 0, blows_ = 0;  // of this step
  MovingBodies bodies_;
  CollisionPairs pairs_;
  StepEquations equations_;
  Springs springs_;
  std::vector<Load> loads_;
  std::vector<Load> spring_loads_;  // with the speeds that dampers have at the end of the substep before
  std::vector<Load> actuations_;
  std::vector<Motor> motors_;
  std::vector<Velocity> ways_;  // of all bodies
  double last_duration_ = 0.0;  // of the substep before; 0: none since `restore` [s]
};

}  // namespace energymargin
