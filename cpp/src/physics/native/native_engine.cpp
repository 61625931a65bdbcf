#include "physics/native/native_engine.hpp"

#include <algorithm>

namespace energymargin {
namespace {

// Substeps in which bodies come into contact with each other; the rest of the step is lost then, and nothing moves.
constexpr int most_substeps = 32;
constexpr int most_tries = 4;  // of lengths of a substep, to find the one that ends in contact

// Substeps that end where bodies touch; then gaps close along the normals of now. Blows; then nothing bounces.
constexpr int most_touches = 24, most_blows = 96;

// A substep that would be shorter than this share of a step is not tried: bodies are in contact already. If they turn
// into each other, one of this share of the one before may be short enough for penetration recovery.
constexpr double shortest_substep = 1e-4;
constexpr double blocked_share = 0.25;

// What turns fast in a loop asks for substeps, but for none shorter than this share of a step.
constexpr double shortest_turn = 1.0 / 16.0;

constexpr double blow_duration = 1e-6;  // of a step: its loads and ways count nothing

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

SubstepResult NativeEngine::advance(double left) {
  load_bodies();
  bodies_.drive(motors_);
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

// Each step begins with the numbers of a state, be it the first one of a rollout or not.
void NativeEngine::settle() {
  bodies_.read(state_);
  bodies_.put(state_);
  substeps_ = touches_ = blows_ = 0;
}

// What bounces and touches parts.
SubstepResult NativeEngine::blow() {
  const Substep substep{blow_duration * step_, pairs_.points(), motors_, Bounces::now};
  const bool converged = equations_.solve(substep);
  equations_.commit(substep, 1.0);
  equations_.join_velocities(0.0);
  in_step_ = true;
  ++blows_;
  spring_loads_ = springs_.loads(true);
  return {0.0, 0.0, converged};
}

}  // namespace energymargin
