#include "quasistatic/adapters.hpp"

#include <ompl/base/MotionValidator.h>
#include <ompl/base/goals/GoalSampleableRegion.h>
#include <ompl/base/objectives/MinimaxObjective.h>
#include <ompl/base/samplers/InformedStateSampler.h>

#include <algorithm>
#include <memory>

#include "quasistatic/barrier_problem.hpp"
#include "quasistatic/pose_space.hpp"

namespace energymargin::quasistatic {
namespace {

namespace ob = ompl::base;

// Free, within the problem's bounds, and below the bound on the energy.
class Allowed : public ob::StateValidityChecker {
 public:
  Allowed(const ob::SpaceInformationPtr& si, BarrierProblem& problem) : StateValidityChecker(si), problem_(problem) {}

  bool isValid(const ob::State* state) const override {
    return problem_.landscape().energy(pose_of(state)) < problem_.bound() &&
           problem_.landscape().allowed(pose_of(state));
  }

 private:
  BarrierProblem& problem_;
};

// A motion of which all that holds.
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

}  // namespace

ob::SpaceInformationPtr space_information(BarrierProblem& problem, double reach) {
  const auto space = std::make_shared<PoseSpace>(problem.landscape(), reach);
  space->setStateSamplerAllocator(
      [&problem](const ob::StateSpace* of) { return std::make_shared<CapturedSampler>(of, problem); });
  const auto si = std::make_shared<ob::SpaceInformation>(space);
  si->setStateValidityChecker(std::make_shared<Allowed>(si, problem));
  si->setMotionValidator(std::make_shared<Passable>(si, problem));
  si->setup();
  return si;
}

ob::ProblemDefinitionPtr definition(const ob::SpaceInformationPtr& si, BarrierProblem& problem) {
  const auto definition = std::make_shared<ob::ProblemDefinition>(si);
  definition->setGoal(std::make_shared<Outside>(si, problem));
  definition->setOptimizationObjective(std::make_shared<HighestEnergy>(si, problem));
  PoseSpace::StateType start;
  start.pose = problem.landscape().start();
  definition->addStartState(&start);
  return definition;
}

}  // namespace energymargin::quasistatic
