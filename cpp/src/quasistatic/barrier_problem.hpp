#pragma once
// Leave the capture set over a lower barrier than the best so far: the problem that OMPL's planners are asked.

#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/SpaceInformation.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"
#include "quasistatic/landscape.hpp"
#include "quasistatic/pose_sampler.hpp"

namespace energymargin::quasistatic {

//! The streams of a search's seed, one for each of what draws from it.
namespace streams {
inline constexpr std::uint64_t poses = 1, rrt_star = 2;
}

//! A pose as OMPL's planners see it.
struct PoseState : ompl::base::State {
  Pose pose;
};
inline const Pose& pose_of(const ompl::base::State* state) { return state->as<PoseState>()->pose; }
inline Pose& pose_of(ompl::base::State* state) { return state->as<PoseState>()->pose; }

//! What limits a search.
struct Budget {
  int samples = 0;  //!< poses to draw
  std::uint64_t seed = 0;
  std::optional<double> reach{};  //!< half the edge of the box around the start to draw from [m]; unset: found
  Limit limit{};                  //!< ends the search early
};

//! Definition 2 wants the path of the lowest barrier. A planner finds some path; the next one has to be lower.
class BarrierProblem {
 public:
  //! `object` moves freely. Throws std::invalid_argument if there seems to be no outside in reach.
  BarrierProblem(const Problem& problem, std::size_t object, const Budget& budget);

  //! OMPL's checkers and samplers refer to this very object.
  BarrierProblem(const BarrierProblem&) = delete;
  BarrierProblem& operator=(const BarrierProblem&) = delete;

  const ompl::base::SpaceInformationPtr& space_information() const { return si_; }

  //! The problem anew: from the start to outside below the present bound. Null if no pose outside could be drawn there.
  ompl::base::ProblemDefinitionPtr ask();

  //! Poses drawn so far, one more for each call of `ask`.
  int samples() const { return samples_; }

  //! True once the samples are spent, or nothing is left to improve.
  bool finished() const;

  //! True once it is finished, or the limit is reached.
  bool spent() const { return finished() || budget_.limit.reached(); }

  //! Highest energy on the best path so far; inf if there is none [J].
  double energy() const { return energy_; }

  //! What a better path has to stay below: a little less than that [J].
  double bound() const;

  //! Takes a planner's solution, makes the best of it, and keeps it if it is the best so far. Clears the solution.
  void take(ompl::base::ProblemDefinition& definition);

  const Path& path() const { return path_; }
  const std::vector<std::pair<int, double>>& history() const { return history_; }
  Landscape& landscape() { return landscape_; }
  std::uint64_t seed() const { return budget_.seed; }

  //! The next pose below the bound, first those drawn before. False if a draw was in vain.
  bool draw(Side side, Pose& pose);

  //! Instead of a draw in vain: a pose near the start, allowed or not, and one outside that a planner knows already.
  Pose fallback_pose();
  const Pose& first_goal() const { return outside_.poses.front(); }

  //! How many poses outside a planner may ask for by now.
  std::size_t most_goals() const;

 private:
  struct Pool {  // of poses drawn
    std::vector<Pose> poses;
    std::size_t next = 0;

    void restart(const Landscape& landscape, double bound);
  };

  void count_sample();
  void keep(Path path);
  Pool& pool(Side side) { return side == Side::captured ? captured_ : outside_; }

  Budget budget_;
  Landscape landscape_;
  PoseSampler sampler_;
  ompl::base::SpaceInformationPtr si_;
  Pool captured_, outside_;
  int samples_ = 0;
  double energy_;
  std::shared_ptr<const void> quiet_;
  Path path_;
  std::vector<std::pair<int, double>> history_;
};

//! BIT* (Gammell, Srinivasa and Barfoot), run again for a lower barrier after each escape, with the poses drawn so far
//! that are below it. OMPL's own pruning stays off: with several goals it may drop the start (its issue 949).
void bit_star(BarrierProblem& problem);

//! RRT* (Karaman and Frazzoli), asked on for a lower barrier after each escape; its tree stays, as far as it is lower.
void rrt_star(BarrierProblem& problem);

}  // namespace energymargin::quasistatic
