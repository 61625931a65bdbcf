#pragma once
// What steps a scene: the one place where the dynamics can be exchanged.

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "base/check.hpp"
#include "energymargin/world.hpp"
#include "physics/contacts/collision_pairs.hpp"
#include "physics/springs.hpp"

namespace energymargin {

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

//! Where the bodies of a scene are, what acts on them, and what a step makes of it. What makes rollouts pure functions
//! is `restore`: nothing of the past is left.
class Engine {
 public:
  explicit Engine(const Scene& scene)
      : scene_(scene),
        objects_(scene.with_role(Role::object)),
        layout_(scene),
        step_(scene.stepping().step),
        bodies_(scene_),
        pairs_(scene_, bodies_.poses()),
        springs_(scene_, bodies_) {}
  virtual ~Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

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
    last_duration_ = 0.0;
    unload();
    spring_loads_ = springs_.loads(true);
    forget();
  }

  //! Goes on by what is left of a step [s], or by less.
  virtual SubstepResult advance(double left) = 0;

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

  const Springs& springs() const { return springs_; }
  const std::vector<Load>& spring_loads() const { return spring_loads_; }

  //! Sums up the work of the impulses in the next steps, while that has a motion to begin with; null where the engine
  //! does not tell it.
  virtual ImpulseAudit* impulses() { return nullptr; }

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
    const std::vector<double>& after = pushed(bodies_.link(load.body)->tree);
    double power = before.power;
    for (std::size_t i = 0; i < after.size(); ++i) power += before.along[i] * after[i];
    return 0.5 * power;
  }

  //! They have the forces of the last substep.
  std::vector<Contact> contacts() const {
    std::vector<Contact> contacts;
    for (const ContactPoint& point : pairs_.points()) {
      if (!pairs_.touches(point)) continue;
      contacts.push_back({scene_.bodies()[point.a].name, scene_.bodies()[point.b].name, from_bullet(point.on_b),
                          from_bullet(point.normal), point.distance, point.normal_impulse / last_duration(),
                          from_bullet(point.friction_impulse / last_duration()),
                          scene_.contact_friction(point.a, point.b)});
    }
    return contacts;
  }

  //! Sum of the normal impulses between two bodies in the last substep [N s].
  double normal_impulse(std::size_t a, std::size_t b) const {
    double impulse = 0.0;
    for (const ContactPoint& point : pairs_.points()) {
      if (std::minmax(point.a, point.b) == std::minmax(a, b)) impulse += point.normal_impulse;
    }
    return impulse;
  }

  //! The bodies where the last `restore` or `advance` left them.
  const CollisionPairs& pairs() const { return pairs_; }

 protected:
  //! Gives the bodies all that acts in the next substep, but for motors.
  void load_bodies() {
    bodies_.clear_loads();
    for (const std::vector<Load>* loads : {&loads_, &actuations_, &spring_loads_}) {
      for (const Load& load : *loads) bodies_.apply(load);
    }
  }

  //! What else an engine knows of the past.
  virtual void forget() = 0;

  //! Velocities of a tree after the last substep's impulses.
  virtual const std::vector<double>& pushed(std::size_t tree) const = 0;

  const Scene scene_;
  const std::vector<std::size_t> objects_;
  const StateLayout layout_;
  const double step_;
  State state_;           // at the end of the last step
  bool in_step_ = false;  // the bodies are further
  MovingBodies bodies_;
  CollisionPairs pairs_;
  Springs springs_;
  std::vector<Load> loads_;
  std::vector<Load> spring_loads_;  // with the speeds that dampers have at the end of the substep before
  std::vector<Load> actuations_;
  std::vector<Motor> motors_;
  double last_duration_ = 0.0;  // of the substep before; 0: none since `restore` [s]

 private:
  double last_duration() const { return last_duration_ > 0.0 ? last_duration_ : step_; }
};

//! The one that the scene asks for. Throws std::invalid_argument if that cannot do what the scene has.
std::unique_ptr<Engine> make_engine(const Scene& scene);

}  // namespace energymargin
