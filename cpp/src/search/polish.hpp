#pragma once
// Changes all edges of an escape at once, and learns from those changes that made it cheaper.

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "base/portable.hpp"
#include "search/edge_changes.hpp"
#include "search/ompl_random.hpp"

namespace energymargin::search {

//! What came of a trial.
enum class Outcome {
  better,      ///< than the best point: it is the new one
  worse,       ///< than it
  infeasible,  ///< it breaks the constraint
};

//! Steps from the best point, normal with a covariance that adapts to the steps that succeed, and shrinks along those
//! that break the constraint. D. V. Arnold and N. Hansen, A (1+1)-CMA-ES for Constrained Optimisation, GECCO 2012.
class EvolutionStrategy {
 public:
  //! Steps are drawn by `rng`, which has to outlive this. The first have this standard deviation in each coordinate.
  EvolutionStrategy(const Eigen::VectorXd& deviations, Draws& rng)
      : rng_(rng),
        factor_(deviations.asDiagonal()),
        path_(Eigen::VectorXd::Zero(deviations.size())),
        violation_(path_) {}

  //! A step A z, in units of `size`. Several may be drawn before any is told.
  Eigen::VectorXd draw() {
    Eigen::VectorXd normal(path_.size());
    for (double& number : normal) number = rng_.gaussian01();
    return factor_ * normal;
  }

  //! What came of a step.
  void tell(const Eigen::VectorXd& step, Outcome outcome) {
    if (outcome == Outcome::infeasible) return learn_violation(step);
    const bool success = outcome == Outcome::better;
    success_rate_ += rate_memory * ((success ? 1.0 : 0.0) - success_rate_);
    const double damping = 1.0 + 0.5 * static_cast<double>(step.size());
    size_ *= portable::exp((success_rate_ - target_rate) / (1.0 - target_rate) / damping);
    if (success) learn_success(step);
  }

  //! Size of the steps now, as a share of those at first.
  double size() const { return size_; }

 private:
  static constexpr double target_rate = 2.0 / 11.0;  // of successes, at which the size of the steps stays
  static constexpr double rate_memory = 1.0 / 12.0;

  // The covariance grows along the steps that succeeded.
  void learn_success(const Eigen::VectorXd& step) {
    const auto n = static_cast<double>(step.size());
    const double memory = 2.0 / (n + 2.0);
    const double rate = 2.0 / (n * n + 6.0);
    path_ = (1.0 - memory) * path_ + std::sqrt(memory * (2.0 - memory)) * step;
    const Eigen::VectorXd w = factor_.partialPivLu().solve(path_);
    const double squared = w.squaredNorm();
    const double keep = std::sqrt(1.0 - rate);
    const double gain = keep / squared * (std::sqrt(1.0 + rate * squared / (1.0 - rate)) - 1.0);
    factor_ = keep * factor_ + gain * path_ * w.transpose();
  }

  // The covariance shrinks along those that broke the constraint.
  void learn_violation(const Eigen::VectorXd& step) {
    const auto n = static_cast<double>(step.size());
    const double memory = 1.0 / (n + 2.0);
    const double rate = 0.1 / (n + 2.0);
    violation_ = (1.0 - memory) * violation_ + memory * step;
    const Eigen::VectorXd w = factor_.partialPivLu().solve(violation_);
    factor_ -= rate / w.squaredNorm() * violation_ * w.transpose();
  }

  Draws& rng_;
  double size_ = 1.0;
  double success_rate_ = target_rate;
  Eigen::MatrixXd factor_;     // A, with A A^T the covariance
  Eigen::VectorXd path_;       // s, of the steps that succeeded
  Eigen::VectorXd violation_;  // v, of the steps that broke the constraint
};

//! A (1+1)-CMA-ES over the wrenches and durations of an escape, one edge of which is cut in two first: what one push
//! does may cost less as two. What an edge leaves alone is left alone.
class Polish {
 public:
  //! `largest` bounds the edges. It and the generator have to outlive this.
  Polish(const Edge& largest, Draws& rng) : largest_(largest), rng_(rng) {}

  //! Begins with the edges of an escape; there is at least one.
  void start(TimedEdges escape) {
    best_ = std::move(escape);
    cut_one();
    find_variables();
    strategy_.emplace(first_deviations(), rng_);
    failures_ = 0;
  }

  //! Until the changes have become too small to matter, or too many have failed one after the other.
  bool goes_on() const {
    if (!strategy_) return false;
    const int most_failures = first_failures + failures_a_variable * static_cast<int>(variables_.size());
    return strategy_->size() > smallest_size && failures_ < most_failures;
  }

  //! The edges, changed by a step.
  struct Trial {
    TimedEdges edges;
    Eigen::VectorXd step;
  };

  //! Several may be drawn before any is told.
  Trial draw() {
    Trial trial{best_, strategy_->draw()};
    for (std::size_t i = 0; i < variables_.size(); ++i) {
      const auto [index, axis] = variables_[i];
      TimedEdge& edge = trial.edges[index];
      const double change = strategy_->size() * trial.step[static_cast<Eigen::Index>(i)];
      if (axis == duration) {
        const double steps = std::clamp(edge.steps + change * largest_.steps, 1.0, 1.0 * largest_.steps);
        edge.steps = static_cast<int>(std::lround(steps));
      } else {
        const double bound = largest_.wrenches[axis];
        edge.wrenches[axis] = std::clamp(edge.wrenches[axis] + change * bound, -bound, bound);
      }
    }
    return trial;
  }

  //! What came of a trial: if it leads out for less, the next changes are to its edges.
  void tell(const Trial& trial, Outcome outcome) {
    if (outcome == Outcome::better) best_ = trial.edges;
    failures_ = outcome == Outcome::better ? 0 : failures_ + 1;
    strategy_->tell(trial.step, outcome);
  }

 private:
  // Deviations of the first changes, even in their logarithm, in units of the strongest wrench, and of each duration.
  static constexpr double least_deviation = 0.01;
  static constexpr double largest_deviation = 0.3;
  static constexpr double smallest_size = 0.01;  // of the changes, as a share of those at first
  static constexpr int first_failures = 10;      // one after the other, and so many more a variable, end it
  static constexpr int failures_a_variable = 10;
  static constexpr int most_pushes = 5;  // edges that are not cut any more
  static constexpr int duration = -1;    // instead of an axis

  // Cuts any edge that has a wrench.
  void cut_one() {
    std::vector<std::size_t> pushes;
    for (std::size_t i = 0; i < best_.size(); ++i) {
      if (!best_[i].wrenches.isZero(0.0)) pushes.push_back(i);
    }
    if (pushes.empty() || pushes.size() >= most_pushes) return;
    const auto any = static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(pushes.size()) - 1));
    TimedEdge& first = best_[pushes[any]];
    if (first.steps < 2) return;
    TimedEdge second = first;
    first.steps = rng_.uniformInt(1, first.steps - 1);
    second.steps -= first.steps;
    second.start += first.steps;
    best_.insert(best_.begin() + static_cast<std::ptrdiff_t>(pushes[any]) + 1, second);
  }

  void find_variables() {
    variables_.clear();
    for (std::size_t i = 0; i < best_.size(); ++i) {
      variables_.emplace_back(i, duration);
      for (int axis = 0; axis < largest_.wrenches.size(); ++axis) {
        const int object = axis / wrench_axes * wrench_axes;
        const bool disturbed = !best_[i].wrenches.segment<wrench_axes>(object).isZero(0.0);
        if (disturbed && largest_.wrenches[axis] > 0.0) variables_.emplace_back(i, axis);
      }
    }
  }

  Eigen::VectorXd first_deviations() {
    double strongest = 0.0;
    for (const auto& [index, axis] : variables_) {
      if (axis == duration) continue;
      strongest = std::max(strongest, std::abs(best_[index].wrenches[axis]) / largest_.wrenches[axis]);
    }
    const double deviation =
        portable::exp(rng_.uniformReal(portable::log(least_deviation), portable::log(largest_deviation)));
    Eigen::VectorXd deviations(static_cast<Eigen::Index>(variables_.size()));
    for (std::size_t i = 0; i < variables_.size(); ++i) {
      const auto& [index, axis] = variables_[i];
      const double steps = best_[index].steps / static_cast<double>(largest_.steps);
      deviations[static_cast<Eigen::Index>(i)] = deviation * (axis == duration ? steps : strongest);
    }
    return deviations;
  }

  const Edge& largest_;
  Draws& rng_;
  TimedEdges best_;
  std::vector<std::pair<std::size_t, int>> variables_;  // an edge, and one of its axes or its duration, in units of the
                                                        // largest edge
  std::optional<EvolutionStrategy> strategy_;
  int failures_ = 0;  // one after the other
};

}  // namespace energymargin::search
