#include "quasistatic/quasistatic_problem.hpp"

#include <ompl/base/MotionValidator.h>
#include <ompl/base/goals/GoalSampleableRegion.h>
#include <ompl/base/objectives/MinimaxObjective.h>
#include <ompl/base/samplers/InformedStateSampler.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/util/Console.h>

#include <algorithm>
#include <limits>

#include "base/check.hpp"
#include "energymargin/random.hpp"
#include "quasistatic/relax.hpp"

namespace energymargin::search {
namespace {

namespace ob = ompl::base;

constexpr double least_gain = 1e-4;  // a better way is better by this share
constexpr double infinity = std::numeric_limits<double>::infinity();
// The box to draw from is large enough once this share of the free poses in it is outside of the capture set.
constexpr double fair_share = 0.25;
constexpr int poses_in_box = 64;
constexpr int poses_in_given_box = 2000;
constexpr int most_boxes = 20;
// Sets about orientations have the same share in a box of any size: the first one is as good.
constexpr double more_by_chance = 1.5;
constexpr double least_share = 1.0 / poses_in_box;
constexpr int first_trials = 800;  // to relax a new way
constexpr int first_polish = 64;   // samples from which on the best way is relaxed again
constexpr int most_polish = 4096;  // trials of that
constexpr std::size_t captured_per_goal = 10;
constexpr std::size_t most_goals_asked = 32;  // BIT* goes through all of them for every edge

class Allowed : public ob::StateValidityChecker {
 public:
  Allowed(const ob::SpaceInformationPtr& si, QuasistaticProblem& problem)
      : StateValidityChecker(si), problem_(problem) {}

  bool isValid(const ob::State* state) const override {
    return problem_.statics().energy(pose_of(state)) < problem_.bound() && problem_.statics().allowed(pose_of(state));
  }

 private:
  QuasistaticProblem& problem_;
};

class Passes : public ob::MotionValidator {
 public:
  Passes(const ob::SpaceInformationPtr& si, QuasistaticProblem& problem) : MotionValidator(si), problem_(problem) {}

  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    return problem_.statics().peak(pose_of(from), pose_of(to)).energy < problem_.bound() &&
           problem_.statics().passes(pose_of(from), pose_of(to));
  }
  bool checkMotion(const ob::State* from, const ob::State* to, std::pair<ob::State*, double>& last) const override {
    last.second = 0.0;
    return checkMotion(from, to);
  }

 private:
  QuasistaticProblem& problem_;
};

// Poses in the capture set below the bound, for any planner.
class Draws : public ob::StateSampler {
 public:
  Draws(const ob::StateSpace* space, QuasistaticProblem& problem) : StateSampler(space), problem_(problem) {}

  void sampleUniform(ob::State* state) override {
    if (!problem_.draw(PoseSampler::Side::captured, pose_of(state))) pose_of(state) = problem_.any();
  }
  void sampleUniformNear(ob::State* state, const ob::State*, double) override { sampleUniform(state); }
  void sampleGaussian(ob::State* state, const ob::State*, double) override { sampleUniform(state); }

 private:
  QuasistaticProblem& problem_;
};

// The same for planners that ask for samples below a cost.
class InformedDraws : public ob::InformedSampler {
 public:
  InformedDraws(const ob::ProblemDefinitionPtr& definition, QuasistaticProblem& problem)
      : InformedSampler(definition, 1), problem_(problem) {}

  bool sampleUniform(ob::State* state, const ob::Cost&) override {
    return problem_.draw(PoseSampler::Side::captured, pose_of(state));
  }
  bool sampleUniform(ob::State* state, const ob::Cost&, const ob::Cost& most) override {
    return sampleUniform(state, most);
  }
  bool hasInformedMeasure() const override { return false; }
  double getInformedMeasure(const ob::Cost&) const override { return space_->getMeasure(); }

 private:
  QuasistaticProblem& problem_;
};

// The highest energy of a way, also between its ends.
class HighestEnergy : public ob::MinimaxObjective {
 public:
  HighestEnergy(const ob::SpaceInformationPtr& si, QuasistaticProblem& problem)
      : MinimaxObjective(si), problem_(problem) {}

  ob::Cost identityCost() const override { return ob::Cost(0.0); }
  ob::Cost stateCost(const ob::State* state) const override { return ob::Cost(energy(state)); }
  ob::Cost motionCost(const ob::State* from, const ob::State* to) const override {
    return ob::Cost(problem_.statics().peak(pose_of(from), pose_of(to)).energy);
  }
  ob::Cost motionCostHeuristic(const ob::State* from, const ob::State* to) const override {
    return ob::Cost(std::max(energy(from), energy(to)));
  }
  bool isSymmetric() const override { return true; }
  ob::InformedSamplerPtr allocInformedStateSampler(const ob::ProblemDefinitionPtr& definition,
                                                   unsigned int) const override {
    return std::make_shared<InformedDraws>(definition, problem_);
  }

 private:
  double energy(const ob::State* state) const { return problem_.statics().energy(pose_of(state)); }

  QuasistaticProblem& problem_;
};

// The complement of the capture set.
class Outside : public ob::GoalSampleableRegion {
 public:
  Outside(const ob::SpaceInformationPtr& si, QuasistaticProblem& problem)
      : GoalSampleableRegion(si), problem_(problem) {}

  double distanceGoal(const ob::State* state) const override {
    return problem_.statics().outside(pose_of(state)) ? 0.0 : 1.0;
  }
  void sampleGoal(ob::State* state) const override {
    if (!problem_.draw(PoseSampler::Side::outside, pose_of(state))) pose_of(state) = problem_.known_goal();
  }
  unsigned int maxSampleCount() const override { return static_cast<unsigned int>(problem_.most_goals()); }
  bool couldSample() const override { return false; }  // never wait for one

 private:
  QuasistaticProblem& problem_;
};

}  // namespace

QuasistaticProblem::QuasistaticProblem(const Problem& problem, std::size_t object, const QuasistaticBudget& budget)
    : budget_(budget),
      statics_(problem, object),
      sampler_(statics_, stream(budget.seed, 1), budget.limit),
      energy_(infinity) {
  ompl::msg::setLogLevel(ompl::msg::LOG_ERROR);
  if (statics_.outside(statics_.start())) {
    energy_ = 0.0;
    path_ = {statics_.start()};
    history_.emplace_back(0, 0.0);
    return;
  }
  find_reach();
  if (spent()) return;
  const auto space = std::make_shared<PoseSpace>(statics_, sampler_.reach());
  space->setStateSamplerAllocator([this](const ob::StateSpace* of) { return std::make_shared<Draws>(of, *this); });
  si_ = std::make_shared<ob::SpaceInformation>(space);
  si_->setStateValidityChecker(std::make_shared<Allowed>(si_, *this));
  si_->setMotionValidator(std::make_shared<Passes>(si_, *this));
  si_->setup();
}

// Doubled until a fair share of the box around the start is outside of the capture set.
void QuasistaticProblem::find_reach() {
  double share = 0.0;
  double best = 0.0;
  double reach = budget_.reach.value_or(2.0 * statics_.radius());
  for (int i = 0; i < (budget_.reach ? 1 : most_boxes) && share < fair_share && !spent(); ++i, reach *= 2.0) {
    sampler_.set_reach(reach, false);
    std::vector<Pose> outside;
    const int poses = budget_.reach ? poses_in_given_box : poses_in_box;
    for (int drawn = 0; drawn < poses && outside.size() < fair_share * poses_in_box; ++drawn) {
      const std::optional<Pose> pose = sampler_.draw(infinity, PoseSampler::Side::any);
      if (pose && statics_.outside(*pose)) outside.push_back(statics_.settled(*pose, reach, true));
    }
    const double share_here = static_cast<double>(outside.size()) / poses_in_box;
    if (share_here < more_by_chance * share + least_share) continue;
    share = share_here;
    best = reach;
    outside_.poses = std::move(outside);
  }
  if (spent()) return;
  if (share == 0.0) {
    reject("reach", budget_.reach ? text(*budget_.reach) : "not given, and nothing is found up to " + text(reach),
           "one in which poses of the object outside of its capture set are free");
  }
  sampler_.set_reach(best, !budget_.reach);
}

bool QuasistaticProblem::finished() const { return samples_ >= budget_.samples || bound() <= 0.0; }

double QuasistaticProblem::bound() const { return energy_ * (1.0 - least_gain) - statics_.negligible(); }

void QuasistaticProblem::Pool::restart(const Quasistatics& statics, double bound) {
  const auto above = [&](const Pose& pose) { return statics.energy(pose) >= bound; };
  poses.erase(std::remove_if(poses.begin(), poses.end(), above), poses.end());
  next = 0;
}

ob::ProblemDefinitionPtr QuasistaticProblem::ask() {
  count_sample();  // so that questions end, however little each is better than the one before
  captured_.restart(statics_, bound());
  outside_.restart(statics_, bound());
  Pose goal;
  if (!draw(PoseSampler::Side::outside, goal)) return nullptr;
  outside_.next = 0;
  auto definition = std::make_shared<ob::ProblemDefinition>(si_);
  definition->setGoal(std::make_shared<Outside>(si_, *this));
  definition->setOptimizationObjective(std::make_shared<HighestEnergy>(si_, *this));
  PoseSpace::StateType start;
  start.pose = statics_.start();
  definition->addStartState(&start);
  return definition;
}

bool QuasistaticProblem::draw(PoseSampler::Side side, Pose& pose) {
  Pool& known = pool(side);
  if (known.next == known.poses.size()) {
    if (spent()) return false;
    count_sample();
    const std::optional<Pose> drawn = sampler_.draw(bound(), side, known.poses);
    if (!drawn) return false;
    known.poses.push_back(*drawn);
  }
  pose = known.poses[known.next++];
  return true;
}

// At powers of two the best way is relaxed again, whatever the budget: so more samples never make it worse.
void QuasistaticProblem::count_sample() {
  ++samples_;
  if (path_.empty() || samples_ < first_polish || (samples_ & (samples_ - 1)) != 0) return;
  keep(relax(path_, statics_, sampler_, std::min(2 * samples_, most_polish), budget_.limit));
}

std::size_t QuasistaticProblem::most_goals() const {
  return std::min<std::size_t>(1 + captured_.next / captured_per_goal, most_goals_asked);
}

void QuasistaticProblem::take(ob::ProblemDefinition& definition) {
  if (!definition.hasExactSolution()) return;
  Path found;
  for (const ob::State* state : definition.getSolutionPath()->as<ompl::geometric::PathGeometric>()->getStates()) {
    found.push_back(pose_of(state));
  }
  definition.clearSolutionPaths();
  keep(relax(found, statics_, sampler_, first_trials, budget_.limit));
}

void QuasistaticProblem::keep(Path path) {
  const double energy = barrier(path, statics_).energy;
  if (energy >= energy_) return;
  energy_ = energy;
  path_ = std::move(path);
  history_.emplace_back(samples_, energy_);
}

}  // namespace energymargin::search
