#pragma once
// What happens: one simulation of a Scene.

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "energymargin/audit.hpp"
#include "energymargin/limit.hpp"
#include "energymargin/plan.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/simulator.hpp"
#include "energymargin/state.hpp"

namespace energymargin {

//! A simulation whose numbers are not finite any more.
class Diverged : public std::runtime_error {
 public:
  explicit Diverged(const std::string& what)
      : std::runtime_error("the simulation diverged: " + what + " is not finite") {}
};

//! A rollout on its way.
struct Moment {
  int steps = 0;
  double effort = 0.0;  //!< so far [J]
  State state;
};

//! What one rollout leads to.
struct Rollout {
  State state;          //!< at the end
  double effort = 0.0;  //!< integral of |f . v + tau . omega| dt, eq. 2 and 3 [J]
  double work = 0.0;    //!< the same with its sign [J]
  double energy = 0.0;  //!< mechanical energy at the end, as World::energy [J]
  int steps = 0;
  int unconverged = 0;           //!< steps whose contact solver did not converge
  double lost_time = 0.0;        //!< time in which nothing moved, as bodies would have passed through each other [s]
  bool complete = true;          //!< false if it reached its limit
  std::optional<Audit> audit{};  //!< where the energy went, if that was asked for
  std::vector<Moment> recorded{};
};

//! The simulation steps of a result that is made of rollouts, and how good they were.
struct StepCounts {
  long long steps = 0;
  long long unconverged = 0;  //!< of these, steps whose contact solver did not converge
  double lost_time = 0.0;     //!< time in which nothing moved, as bodies would have passed through each other [s]

  StepCounts() = default;
  StepCounts(const Rollout& rollout)
      : steps(rollout.steps), unconverged(rollout.unconverged), lost_time(rollout.lost_time) {}

  StepCounts& operator+=(const StepCounts& other) {
    steps += other.steps;
    unconverged += other.unconverged;
    lost_time += other.lost_time;
    return *this;
  }
};

//! What is recorded of a rollout, and where it ends early.
struct Watch {
  double cost = 0.0;                                       //!< before the rollout [J]
  double bound = std::numeric_limits<double>::infinity();  //!< it ends with the step at which cost + effort reaches it
  std::vector<int> record{};                               //!< steps after which there is a Moment, ascending
  std::function<bool(const State&)> ends{};                //!< if set: whether it ends with a state
  int check_every = 1;                                     //!< steps from one state that `ends` is asked to the next
  int first = 0;                                           //!< steps of the plan, and of `check_every`, that are over
  const Plan* plan = nullptr;                              //!< if set: in place of the world's; it fits the scene
  const Eigen::VectorXd* commands = nullptr;               //!< of the plan's policy
  const NoiseSeeds* noise = nullptr;                       //!< of what the robot observes; null: none
  bool audit = false;                                      //!< whether the energy is balanced
  bool ends_for_good = false;                              //!< nobody goes on from where `ends` ends it
};

//! A rollout that is to be made: World::rollout_unchecked.
struct RolloutQuestion {
  State state;
  std::vector<Push> pushes;
  Watch watch{};
};

//! The push of these wrenches.
Push push(const Disturbance& wrenches, int steps);

//! One point where two bodies touch, and the forces there over the last part of its step: where bodies come into
//! contact or bounce, a step has several. What a Feedback observes as "force(a, b)" is the mean over a step.
struct Contact {
  std::string body_a, body_b;
  Vector3 position = Vector3::Zero();          //!< on body_b [m]
  Vector3 normal = Vector3::UnitZ();           //!< unit vector, from body_b to body_a
  double distance = 0.0;                       //!< negative in penetration [m]
  double normal_force = 0.0;                   //!< along the normal, on body_a [N]
  Vector3 tangential_force = Vector3::Zero();  //!< friction on body_a [N]
  double friction = 0.0;                       //!< coefficient of the contact: Scene::contact_friction
};

//! One recorded moment of a simulation.
struct Frame {
  double time = 0.0;  //!< [s]
  State state;
  Eigen::VectorXd memory{};  //!< what the plan's feedback remembers
  std::vector<Contact> contacts{};
  int unconverged = 0;     //!< steps until then whose contact solver did not converge
  double lost_time = 0.0;  //!< time until then in which nothing moved [s]
};

//! One simulation of a scene. Every question is answered as a pure function of its
//! arguments: the same bits in any order, in any world of the same scene, on any thread (one thread a world at a time).
class World {
 public:
  explicit World(const Scene& scene);

  //! The robot follows `plan`, whose last targets stay; throws std::invalid_argument unless it fits the scene.
  World(const Scene& scene, const Plan& plan);
  ~World();
  World(World&&) noexcept;

  World& operator=(World&&) noexcept;

  const Scene& scene() const;
  const StateLayout& layout() const;

  //! Numbers that the states of `rollout_unchecked` have behind those of the scene: a simulator's own, and what a
  //! Feedback remembers.
  int memory() const;
  int robot_memory() const;

  //! What plays the rollouts in place of an engine of the library; null: nothing does.
  const Simulator* simulator() const;

  //! Applies a wrench to each object for `duration` [s], rounded to whole steps; effort and work are their sums.
  //! `audit` also balances the energy, and changes no bit. The robot goes on where its plan is after `time` [s]. Throws
  //! std::invalid_argument on bad arguments, Diverged, and Cancelled or TimedOut at the limit.
  Rollout rollout(const State& state, const Disturbance& wrenches, double duration, bool audit = false,
                  const Limit& limit = {}, double time = 0.0);

  //! As `rollout`, under one push after another, without a break, without the checks and without the energy, for
  //! callers that made the arguments themselves. It ends with fewer steps if it reaches the limit, or as `watch` says.
  Rollout rollout_unchecked(const State& state, const std::vector<Push>& pushes, const Limit& limit = {},
                            const Watch& watch = {});

  //! Several of them together, in any of which a simulator steps many; none for one that diverged. There is a
  //! simulator.
  std::vector<std::optional<Rollout>> rollouts_unchecked(const std::vector<RolloutQuestion>& questions,
                                                         const Limit& limit = {});

  //! One simulation of `steps` steps under the world's plan and, on top of it, `besides`, of a row a step or none,
  //! recorded after the steps in `record`, ascending from 0, the start. Throws Cancelled or TimedOut.
  std::vector<Frame> simulate(const State& state, const Plan& besides, int steps, const std::vector<int>& record,
                              const Limit& limit = {});

  //! Kinetic energy, potential energy of gravity and constant forces, zero at the world's origin, and energy of the
  //! springs and of the joints' compliance, zero at their targets [J].
  double energy(const State& state) const;

  //! Contacts at a state, with the forces that one step without wrench shows.
  std::vector<Contact> contacts(const State& state);

  //! Least distance between two bodies [m], negative in penetration; inf between two planes.
  double distance(const State& state, const std::string& body_a, const std::string& body_b);

 private:
  struct Player;

  void require_own_steps(const std::string& what) const;
  std::vector<Frame> simulate_elsewhere(const State& state, const Plan& besides, std::vector<int> record,
                                        const Limit& limit);

  std::unique_ptr<Player> player_;
};

//! Deepest penetration of any two bodies at a valid state [m]; 0 if nothing touches.
Contact deepest_contact(const Scene& scene, const State& state);

}  // namespace energymargin
