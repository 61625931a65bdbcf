#include "quasistatic/barrier_problem.hpp"

#include <ompl/geometric/PathGeometric.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "energymargin/random.hpp"
#include "quasistatic/adapters.hpp"
#include "quasistatic/barrier.hpp"
#include "quasistatic/pose_space.hpp"
#include "quasistatic/relax.hpp"
#include "quasistatic/search_box.hpp"
#include "quasistatic/streams.hpp"
#include "search/quiet.hpp"

namespace energymargin::quasistatic {
namespace {

constexpr double least_gain = 1e-4;  // a better path is better by this share

// How much a planner's paths are relaxed.
struct RelaxSettings {
  int trials = 800;        // of a new path
  int first_sample = 64;   // from which on the best path is relaxed again
  int most_trials = 4096;  // of the best path
};
constexpr RelaxSettings relaxing{};

// How many goals a planner may ask for.
struct GoalSettings {
  std::size_t captured_poses = 10;  // drawn for each
  std::size_t most = 32;            // BIT* goes through all of them for every edge
};
constexpr GoalSettings goals{};

}  // namespace

BarrierProblem::BarrierProblem(const Problem& problem, std::size_t object, const Budget& budget)
    : budget_(budget),
      landscape_(problem, object),
      sampler_(std::make_unique<PoseSampler>(landscape_, stream(budget.seed, streams::poses), budget.limit)),
      energy_(std::numeric_limits<double>::infinity()),
      quiet_(search::quiet_ompl()) {
  if (landscape_.outside(landscape_.start())) {
    energy_ = 0.0;
    path_ = {landscape_.start()};
    history_.emplace_back(0, 0.0);
    return;
  }
  std::optional<SearchBox> box = find_search_box(landscape_, *sampler_, budget.reach, budget.limit);
  if (!box) return;
  outside_.poses = std::move(box->outside);
  sampler_->set_reach(box->reach, !budget.reach);
  si_ = quasistatic::space_information(*this, box->reach);
}

BarrierProblem::~BarrierProblem() = default;

bool BarrierProblem::finished() const { return samples_ >= budget_.samples || bound() <= 0.0; }

double BarrierProblem::bound() const { return energy_ * (1.0 - least_gain) - landscape_.negligible(); }

void BarrierProblem::Pool::restart(const Landscape& landscape, double bound) {
  const auto above = [&](const Pose& pose) { return landscape.energy(pose) >= bound; };
  poses.erase(std::remove_if(poses.begin(), poses.end(), above), poses.end());
  next = 0;
}

std::shared_ptr<ompl::base::ProblemDefinition> BarrierProblem::ask() {
  count_sample();  // so that questions end, however little each is better than the one before
  captured_.restart(landscape_, bound());
  outside_.restart(landscape_, bound());
  Pose goal;
  if (!draw(Side::outside, goal)) return nullptr;
  outside_.next = 0;
  return definition(si_, *this);
}

bool BarrierProblem::draw(Side side, Pose& pose) {
  Pool& known = pool(side);
  if (known.next == known.poses.size()) {
    if (spent()) return false;
    count_sample();
    const std::optional<Pose> sample = sampler_->draw(bound(), side, known.poses);
    if (!sample) return false;
    known.poses.push_back(*sample);
  }
  pose = known.poses[known.next++];
  return true;
}

// At powers of two the best path is relaxed again, whatever the budget: so more samples never make it worse.
void BarrierProblem::count_sample() {
  ++samples_;
  if (path_.empty() || samples_ < relaxing.first_sample || (samples_ & (samples_ - 1)) != 0) return;
  keep(relax(path_, landscape_, *sampler_, std::min(2 * samples_, relaxing.most_trials), budget_.limit));
}

Pose BarrierProblem::fallback_pose() { return sampler_->draw_near(landscape_.start(), landscape_.size()); }

std::size_t BarrierProblem::most_goals() const {
  return std::min<std::size_t>(1 + captured_.next / goals.captured_poses, goals.most);
}

void BarrierProblem::take(ompl::base::ProblemDefinition& definition) {
  if (!definition.hasExactSolution()) return;
  Path path;
  for (const ompl::base::State* state :
       definition.getSolutionPath()->as<ompl::geometric::PathGeometric>()->getStates()) {
    path.push_back(pose_of(state));
  }
  definition.clearSolutionPaths();
  keep(relax(path, landscape_, *sampler_, relaxing.trials, budget_.limit));
}

void BarrierProblem::keep(Path path) {
  const double energy = barrier(path, landscape_).energy;
  if (energy >= energy_) return;
  energy_ = energy;
  path_ = std::move(path);
  history_.emplace_back(samples_, energy_);
}

}  // namespace energymargin::quasistatic
