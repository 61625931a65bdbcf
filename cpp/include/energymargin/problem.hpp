#pragma once
// One question: a scene, a start state, the disturbances that may act, and the sets that matter.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "energymargin/region.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/world.hpp"

namespace energymargin {

//! What the effector does while the object is disturbed.
enum class Effector {
  coast,  ///< no script acts on it (paper, Section V-A); springs, constant forces and joint control act on
  drive,  ///< each edge of the search starts with the velocities of the start state; in between as under coast
};

//! Weights of the force score, Section V-B.
struct ForceWeights {
  double engage = 1.0;         //!< of the normal forces between effector and object [1/N]
  double stick = 1.0;          //!< of their distance to the friction cone's edge [1/N]
  double distance = 10.0;      //!< taken off per metre between object and effector [1/m]
  double ground_engage = 0.0;  //!< as `engage`, for the object's contacts with all that is not the effector [1/N]
  double ground_stick = 0.0;   //!< as `stick`, for those; of use where the object is meant to stick there [1/N]
};

//! The optimal motion planning problem P of Section V-A, with what the scores need besides.
struct Problem {
  //! No disturbance acts, and the question has no clock, until the other members say so.
  Problem(Scene scene, State state, Region captured);

  Scene scene;
  State state;                            //!< z_init
  Vector3 force = Vector3::Zero();        //!< largest |force| on each object along each axis [N]
  Vector3 torque = Vector3::Zero();       //!< largest |torque| about each axis [N m]
  double duration = 0.5;                  //!< longest edge [s]
  Region captured;                        //!< Z_cap(z_init); of several objects: all are captured
  std::optional<Region> succeeded{};      //!< Z_suc; of several objects: all have succeeded
  std::optional<Region> within{};         //!< Z_b: where the search for an escape may go
  std::optional<Region> captured_any{};   //!< of several objects at least one is captured
  std::optional<Region> succeeded_any{};  //!< of several objects at least one has succeeded
  Effector effector = Effector::coast;
  double rate = 5.0;  //!< lambda of eq. 4 [1/J]
  ForceWeights force_weights{};
  std::optional<std::vector<Contact>> contacts{};  //!< measured at the state, for the force score; unset: simulated
  std::optional<double> horizon{};  //!< the question is about so many seconds; unset: the plan's, or no clock at all
  std::optional<Plan> plan{};       //!< of the robot, from the state on; unset: it coasts
  std::optional<double> check{};    //!< between two looks at the capture set [s]; unset: about 1/60
  double dwell = 0.0;               //!< how long an object has to stay outside for an escape [s]
};

//! A problem's time in whole steps of its scene.
struct Timing {
  int horizon;
  int check;
  int dwell;
};

//! None for a problem without horizon and plan, whose question has no clock. The problem is valid.
std::optional<Timing> timing_of(const Problem& problem);

//! Throws std::invalid_argument, in the name of `metric`, if the problem has a clock.
void require_no_clock(const Problem& problem, const std::string& metric);

//! Throws std::invalid_argument if a metric that searches for disturbances has none to choose from.
void require_disturbed(const Problem& problem, const std::string& metric);

//! Throws std::invalid_argument, in the name of `metric`, if an object is on a joint.
void require_free_object(const Problem& problem, std::size_t object, const std::string& metric);

//! Whether a region asks how strongly two bodies press on each other: a regions::Touching with a force.
bool asks_for_force(const Region& region);

//! Throws std::invalid_argument on bad numbers, times that are not whole steps, parts that do not fit each other or the
//! scene, and a start in which a moving body is deeper in another than half of the smaller one's smallest half extent.
void validate(const Problem& problem);

//! The same question in a simulation with another step [s]; a plan with shorter rows has their means. Throws
//! std::invalid_argument where a time is not whole steps of this length, or a spring is too stiff for it.
Problem with_step(const Problem& problem, double step);

//! The same question in a simulation by another engine: Scene::with_engine.
Problem with_engine(const Problem& problem, EngineKind engine);

//! The same question in a simulation by a simulator, in its steps. Throws std::invalid_argument where a time is not
//! whole ones, and what that does not do is asked for.
Problem with_simulator(const Problem& problem, std::shared_ptr<const Simulator> simulator);

//! The world of a problem: with its plan, if it has one. Its steps are so many `parts` of the problem's.
World world_of(const Problem& problem, int parts = 1);

//! A push of no wrench on any object.
Push no_push(const Problem& problem, int steps);

//! Of several objects, how many have to leave for an escape.
enum class Captured {
  all,  ///< while all are captured: one that leaves is an escape
  any,  ///< while at least one is captured: an escape is when the last one has left
};

//! The set that an escape leaves. Throws std::invalid_argument if the problem has no set for `any`.
const Region& capture_set(const Problem& problem, Captured captured);

//! The capture sets of the objects, in the scene's order; empty where there is one for all.
std::vector<Region> captured_by_object(const Problem& problem);

//! Where an edge of the search starts.
class EdgeStart {
 public:
  explicit EdgeStart(const Problem& problem);

  //! At its node's state or, under Effector::drive, there with the effector at its velocities of the start state.
  State operator()(const State& node) const;

 private:
  std::vector<std::pair<int, Eigen::VectorXd>> driven_;  // velocities, and where they stand in a state
};

}  // namespace energymargin
