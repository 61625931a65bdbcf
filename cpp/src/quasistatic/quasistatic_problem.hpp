#pragma once
// Leave the capture set over a lower barrier than the best so far: the problem that OMPL's planners are asked.

#include <ompl/base/PlannerTerminationCondition.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/SpaceInformation.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"
#include "quasistatic/pose_sampler.hpp"
#include "quasistatic/pose_space.hpp"

namespace energymargin::search {

//! What limits a search.
struct QuasistaticBudget {
  int samples = 0;  //!< poses to draw
  std::uint64_t seed = 0;
  std::optional<double> reach{};  //!< half the edge of the box around the start to draw from [m]; unset: found
  Limit limit{};                  //!< ends the search early
};

class QuasistaticProblem {
 public:
  //! `object` is the index of a body that moves freely. Throws std::invalid_argument if there seems to be no outside in
  //! reach.
  QuasistaticProblem(const Problem& problem, std::size_t object, const QuasistaticBudget& budget);

  //! OMPL's checkers and samplers refer to this very object.
  QuasistaticProblem(const QuasistaticProblem&) = delete;
  QuasistaticProblem& operator=(const QuasistaticProblem&) = delete;

  const ompl::base::SpaceInformationPtr& space_information() const { return si_; }

  //! The question anew: from the start to outside below the present bound. None if no pose outside could be drawn
  //! there.
  ompl::base::ProblemDefinitionPtr ask();

  //! Poses drawn so far, and questions asked.
  int samples() const { return samples_; }

  //! True once the samples are spent, or nothing is left to improve.
  bool finished() const;

  //! True once it is finished, or the limit is reached.
  bool spent() const { return finished() || budget_.limit.reached(); }

  //! Highest energy on the best way so far; inf if there is none [J].
  double energy() const { return energy_; }

  //! What a better way has to stay below: a little less than that [J].
  double bound() const;

  //! Takes a planner's solution, makes the best of it, and keeps it if it is the best so far. Clears the solution.
  void take(ompl::base::ProblemDefinition& definition);

  const Path& path() const { return path_; }
  const std::vector<std::pair<int, double>>& history() const { return history_; }
  Quasistatics& statics() { return statics_; }
  std::uint64_t seed() const { return budget_.seed; }

  //! The next pose below the bound, first those drawn before. False if a draw was in vain.
  bool draw(PoseSampler::Side side, Pose& pose);

  //! Instead of a draw in vain: a pose near the start, allowed or not, and one outside that a planner knows already.
  Pose any() { return sampler_.near(statics_.start(), statics_.size()); }
  const Pose& known_goal() const { return outside_.poses.front(); }

  //! How many poses outside a planner may ask for by now.
  std::size_t most_goals() const;

 private:
  struct Pool {  // of poses drawn
    std::vector<Pose> poses;
    std::size_t next = 0;

    void restart(const Quasistatics& statics, double bound);
  };

  void find_reach();
  void count_sample();
  void keep(Path path);
  Pool& pool(PoseSampler::Side side) { return side == PoseSampler::Side::captured ? captured_ : outside_; }

  QuasistaticBudget budget_;
  Quasistatics statics_;
  PoseSampler sampler_;
  ompl::base::SpaceInformationPtr si_;
  Pool captured_, outside_;
  int samples_ = 0;
  double energy_;
  Path path_;
  std::vector<std::pair<int, double>> history_;
};

}  // namespace energymargin::search
