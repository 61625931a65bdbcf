#include "quasistatic/barrier_problem.hpp"

#include <ompl/base/MotionValidator.h>
#include <ompl/base/StateSpace.h>
#include <ompl/base/goals/GoalSampleableRegion.h>
#include <ompl/base/objectives/MinimaxObjective.h>
#include <ompl/base/samplers/InformedStateSampler.h>
#include <ompl/geometric/PathGeometric.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "energymargin/random.hpp"
#include "search/cost_space.hpp"

namespace energymargin::quasistatic {
namespace {

namespace ob = ompl::base;

constexpr double least_gain = 1e-4;  // a better path is better by this share

constexpr int trials_of_a_path = 800;  // to relax it
constexpr int first_relaxation = 64;   // samples, from which on the best path is relaxed again
constexpr int most_trials_again = 4096;
constexpr std::size_t captured_poses_per_goal = 10;  // drawn before a planner may ask for one more
constexpr std::size_t most_goals_of_a_planner = 32;  // BIT* goes through all of them for every edge

// A motion on which all poses are allowed.
class Passable : public ob::MotionValidator {
 public:
  Passable(const ob::SpaceInformationPtr& si, BarrierProblem& problem) : MotionValidator(si), problem_(problem) {}

  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    return problem_.landscape().peak(pose_of(from), pose_of(to)).energy < problem_.bound() &&
           problem_.landscape().passes(pose_of(from), pose_of(to));
  }
  bool checkMotion(const ob::State* from, const ob::State* to, std::pair<ob::State*, double>& last) const override {
    last.second = 0.0;
    return checkMotion(from, to);
  }

 private:
  BarrierProblem& problem_;
};

// Poses in the capture set below the bound, for any planner.
class CapturedSampler : public ob::StateSampler {
 public:
  CapturedSampler(const ob::StateSpace* space, BarrierProblem& problem) : StateSampler(space), problem_(problem) {}

  void sampleUniform(ob::State* state) override {
    if (!problem_.draw(Side::captured, pose_of(state))) pose_of(state) = problem_.fallback_pose();
  }
  void sampleUniformNear(ob::State* state, const ob::State*, double) override { sampleUniform(state); }
  void sampleGaussian(ob::State* state, const ob::State*, double) override { sampleUniform(state); }

 private:
  BarrierProblem& problem_;
};

// The same for planners that want samples below a cost: the bound is below it.
class InformedCapturedSampler : public ob::InformedSampler {
 public:
  InformedCapturedSampler(const ob::ProblemDefinitionPtr& definition, BarrierProblem& problem)
      : InformedSampler(definition, 1), problem_(problem) {}

  bool sampleUniform(ob::State* state, const ob::Cost&) override {
    return problem_.draw(Side::captured, pose_of(state));
  }
  bool sampleUniform(ob::State* state, const ob::Cost&, const ob::Cost& most) override {
    return sampleUniform(state, most);
  }
  bool hasInformedMeasure() const override { return false; }
  double getInformedMeasure(const ob::Cost&) const override { return space_->getMeasure(); }

 private:
  BarrierProblem& problem_;
};

// The highest energy of a motion, also between its ends.
class HighestEnergy : public ob::MinimaxObjective {
 public:
  HighestEnergy(const ob::SpaceInformationPtr& si, BarrierProblem& problem) : MinimaxObjective(si), problem_(problem) {}

  ob::Cost identityCost() const override { return ob::Cost(0.0); }
  ob::Cost stateCost(const ob::State* state) const override { return ob::Cost(energy(state)); }
  ob::Cost motionCost(const ob::State* from, const ob::State* to) const override {
    return ob::Cost(problem_.landscape().peak(pose_of(from), pose_of(to)).energy);
  }
  ob::Cost motionCostHeuristic(const ob::State* from, const ob::State* to) const override {
    return ob::Cost(std::max(energy(from), energy(to)));
  }
  bool isSymmetric() const override { return true; }
  ob::InformedSamplerPtr allocInformedStateSampler(const ob::ProblemDefinitionPtr& definition,
                                                   unsigned int) const override {
    return std::make_shared<InformedCapturedSampler>(definition, problem_);
  }

 private:
  double energy(const ob::State* state) const { return problem_.landscape().energy(pose_of(state)); }

  BarrierProblem& problem_;
};

// The complement of the capture set.
class Outside : public ob::GoalSampleableRegion {
 public:
  Outside(const ob::SpaceInformationPtr& si, BarrierProblem& problem) : GoalSampleableRegion(si), problem_(problem) {}

  double distanceGoal(const ob::State* state) const override {
    return problem_.landscape().outside(pose_of(state)) ? 0.0 : 1.0;
  }
  void sampleGoal(ob::State* state) const override {
    if (!problem_.draw(Side::outside, pose_of(state))) pose_of(state) = problem_.first_goal();
  }
  unsigned int maxSampleCount() const override { return static_cast<unsigned int>(problem_.most_goals()); }
  bool couldSample() const override { return false; }  // never wait for one

 private:
  BarrierProblem& problem_;
};

// Poses of the object. The distance of two is the farthest that any point of the object moves on the way, or a little
// more: a turn counts by the object's radius, and not at all where it makes no difference.
class PoseSpace : public ob::StateSpace {
 public:
  // `reach` is half the edge of the box around the start that positions are drawn from [m].
  PoseSpace(BarrierProblem& problem, double reach) : problem_(problem), landscape_(problem.landscape()) {
    setName("Pose");
    const double slides = landscape_.sliding().sum();
    const Turning turning = landscape_.turning();
    dimension_ = static_cast<unsigned int>(slides);
    extent_ = 2.0 * reach * std::sqrt(slides);
    if (turning == Turning::none) return;
    dimension_ += turning == Turning::about_axis ? 1 : 3;
    extent_ += pi * landscape_.radius();
  }

  unsigned int getDimension() const override { return dimension_; }
  double getMaximumExtent() const override { return extent_; }
  double getMeasure() const override { return 1.0; }  // samples are drawn below a bound, in no simple shape
  void enforceBounds(ob::State*) const override {}
  bool satisfiesBounds(const ob::State*) const override { return true; }
  double distance(const ob::State* a, const ob::State* b) const override {
    return landscape_.length(pose_of(a), pose_of(b));
  }
  void copyState(ob::State* destination, const ob::State* source) const override {
    pose_of(destination) = pose_of(source);
  }
  bool equalStates(const ob::State* a, const ob::State* b) const override {
    return pose_of(a).position == pose_of(b).position &&
           pose_of(a).orientation.coeffs() == pose_of(b).orientation.coeffs();
  }
  void interpolate(const ob::State* from, const ob::State* to, double t, ob::State* state) const override {
    pose_of(state) = quasistatic::interpolate(pose_of(from), pose_of(to), t);
  }
  ob::StateSamplerPtr allocDefaultStateSampler() const override {
    return std::make_shared<CapturedSampler>(this, problem_);
  }
  ob::State* allocState() const override { return new PoseState; }
  void freeState(ob::State* state) const override { delete state->as<PoseState>(); }

 private:
  BarrierProblem& problem_;
  const Landscape& landscape_;
  unsigned int dimension_ = 0;
  double extent_ = 0.0;
};

}  // namespace

BarrierProblem::BarrierProblem(const Problem& problem, std::size_t object, const Budget& budget)
    : budget_(budget),
      landscape_(problem, object),
      sampler_(landscape_, stream(budget.seed, streams::poses), budget.limit),
      energy_(std::numeric_limits<double>::infinity()),
      quiet_(search::quiet_ompl()) {
  if (landscape_.outside(landscape_.start())) {
    energy_ = 0.0;
    path_ = {landscape_.start()};
    history_.emplace_back(0, 0.0);
    return;
  }
  std::optional<std::vector<Pose>> outside = sampler_.find_box(budget.reach);
  if (!outside) return;
  outside_.poses = std::move(*outside);
  si_ = std::make_shared<ob::SpaceInformation>(std::make_shared<PoseSpace>(*this, sampler_.reach()));
  si_->setStateValidityChecker([this](const ob::State* state) {  // below the bound, free, and within Z_b
    return landscape_.energy(pose_of(state)) < bound() && landscape_.allowed(pose_of(state));
  });
  si_->setMotionValidator(std::make_shared<Passable>(si_, *this));
  si_->setup();
}

bool BarrierProblem::finished() const { return samples_ >= budget_.samples || bound() <= 0.0; }

double BarrierProblem::bound() const { return energy_ * (1.0 - least_gain) - landscape_.negligible(); }

void BarrierProblem::Pool::restart(const Landscape& landscape, double bound) {
  const auto above = [&](const Pose& pose) { return landscape.energy(pose) >= bound; };
  poses.erase(std::remove_if(poses.begin(), poses.end(), above), poses.end());
  next = 0;
}

ob::ProblemDefinitionPtr BarrierProblem::ask() {
  count_sample();  // so that questions end, however little each is better than the one before
  captured_.restart(landscape_, bound());
  outside_.restart(landscape_, bound());
  Pose goal;
  if (!draw(Side::outside, goal)) return nullptr;
  outside_.next = 0;
  const auto definition = std::make_shared<ob::ProblemDefinition>(si_);
  definition->setGoal(std::make_shared<Outside>(si_, *this));
  definition->setOptimizationObjective(std::make_shared<HighestEnergy>(si_, *this));
  PoseState start;
  start.pose = landscape_.start();
  definition->addStartState(&start);
  return definition;
}

bool BarrierProblem::draw(Side side, Pose& pose) {
  Pool& known = pool(side);
  if (known.next == known.poses.size()) {
    if (spent()) return false;
    count_sample();
    const std::optional<Pose> sample = sampler_.draw(bound(), side, known.poses);
    if (!sample) return false;
    known.poses.push_back(*sample);
  }
  pose = known.poses[known.next++];
  return true;
}

// At powers of two the best path is relaxed again, whatever the budget: so more samples never make it worse.
void BarrierProblem::count_sample() {
  ++samples_;
  if (path_.empty() || samples_ < first_relaxation || (samples_ & (samples_ - 1)) != 0) return;
  keep(relax(path_, landscape_, sampler_, std::min(2 * samples_, most_trials_again), budget_.limit));
}

Pose BarrierProblem::fallback_pose() { return sampler_.draw_near(landscape_.start(), landscape_.size()); }

std::size_t BarrierProblem::most_goals() const {
  return std::min<std::size_t>(1 + captured_.next / captured_poses_per_goal, most_goals_of_a_planner);
}

void BarrierProblem::take(ob::ProblemDefinition& definition) {
  if (!definition.hasExactSolution()) return;
  Path path;
  for (const ob::State* state : definition.getSolutionPath()->as<ompl::geometric::PathGeometric>()->getStates()) {
    path.push_back(pose_of(state));
  }
  definition.clearSolutionPaths();
  keep(relax(path, landscape_, sampler_, trials_of_a_path, budget_.limit));
}

void BarrierProblem::keep(Path path) {
  const double energy = landscape_.barrier(path).energy;
  if (energy >= energy_) return;
  energy_ = energy;
  path_ = std::move(path);
  history_.emplace_back(samples_, energy_);
}

}  // namespace energymargin::quasistatic
