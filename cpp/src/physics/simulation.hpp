#pragma once
// A Scene in Bullet.

#include <vector>

#include "energymargin/world.hpp"
#include "physics/contacts/collision_pairs.hpp"
#include "physics/solver/step_equations.hpp"
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

//! Bullet's side of a World. What makes rollouts pure functions is `restore`.
class Simulation {
 public:
  explicit Simulation(const Scene& scene);
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  const Scene& scene() const { return scene_; }
  const StateLayout& layout() const { return layout_; }
  int whole_steps(double duration) const;

  //! Bodies of role "object", in the scene's order.
  const std::vector<std::size_t>& objects() const { return objects_; }

  //! Sets anew everything that could carry the past into the next rollout.
  void restore(const State& state);

  //! Throws Diverged if the state is not finite.
  void read(State& state) const;
  void read(Motion& motion) const;
  void read(std::vector<Velocity>& velocities) const;

  //! What acts until `unload`; the loads of the robot's plan are listed on their own.
  void load(const Load& load) { loads_.push_back(load); }
  void actuate(const Load& load) { actuations_.push_back(load); }
  void unload();
  const std::vector<Load>& actuations() const { return actuations_; }

  //! A motor of limited force [N] and torque [N m] keeps a free body at the velocities of its frame, until `unload`.
  void add_motor(std::size_t body, const Vector3& linear, const Vector3& angular, double force, double torque);

  //! The target of a joint or, beyond all joints, a tendon, until `restore`.
  void set_target(std::size_t index, double target) { bodies_.set_target(index, target); }
  double target(std::size_t index) const { return bodies_.target(index); }

  //! Goes on by `duration` [s], or by less where bodies come into contact on the way. `substeps` of the step are over;
  //! if they are too many, the rest is lost: velocities change, and nothing moves further than into contact.
  SubstepResult advance(double duration, int substeps);

  const Springs& springs() const { return springs_; }
  const std::vector<Load>& spring_loads() const { return spring_loads_; }

  //! Sums up the work of the impulses in the next steps, while that has a motion to begin with.
  ImpulseAudit& impulses() { return equations_.audit; }

  //! What a load acts on, as a substep begins.
  LoadedMotion before(const Load& load) const;

  //! Mean power of a load in the last substep, from what it was before to after its impulses and before it coasted: the
  //! work on a free body is exactly its gain of kinetic energy [W].
  double power(const Load& load, const LoadedMotion& before) const;

  //! They have the forces of the last substep.
  std::vector<Contact> contacts() const;

  //! The bodies where the last `restore` or `advance` left them.
  const CollisionPairs& pairs() const { return pairs_; }

 private:
  void load_bodies();

  Scene scene_;
  std::vector<std::size_t> objects_;
  StateLayout layout_;
  double step_;
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
