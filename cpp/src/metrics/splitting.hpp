#pragma once
// Adaptive multilevel splitting: the probability of a rare event from replicas of a random path that split where they
// come near it. Brehier, Gazeau, Goudenege, Lelievre and Rousset, Annals of Applied Probability, 2016.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

#include "base/portable.hpp"
#include "base/random_draws.hpp"
#include "energymargin/limit.hpp"

namespace energymargin::splitting {

//! The level of a path on which the event has happened.
inline constexpr double happened = std::numeric_limits<double>::infinity();

//! The last generation of replicas. For any function f of a path that is 0 unless the event happens, `weight` times the
//! mean of f over the replicas is an unbiased estimate of its expectation.
template <typename Replica>
struct Generation {
  std::vector<Replica> replicas;
  double weight = 1.0;   //!< 0 if no replica came near enough
  int levels = 0;        //!< at which replicas were killed
  bool complete = true;  //!< false if the limit was reached
};

//! A path that is to be made: from the start or, with a parent, with that one's past up to where its level, which may
//! depend on the past, first is above `level`, from where it goes on by the path's law.
template <typename Replica>
struct Path {
  std::size_t number;
  const Replica* parent = nullptr;
  double level = 0.0;
};

//! A Replica has `highest()`, the highest level of its path. In each round all replicas of the lowest level are killed,
//! and branch from others drawn evenly.
template <typename Replica>
class Splitting {
 public:
  //! `random` outlives it.
  Splitting(int count, Random& random) : count_(static_cast<std::size_t>(count)), random_(&random) {
    generation_.complete = false;
  }

  //! The paths of the next round; none once it has ended. They are valid until `take`.
  std::vector<Path<Replica>> next() {
    std::vector<Replica>& replicas = generation_.replicas;
    std::vector<Path<Replica>> paths;
    if (replicas.empty()) {
      for (; number_ < count_; ++number_) paths.push_back({number_});
      return paths;
    }
    const auto is_lower = [](const Replica& a, const Replica& b) { return a.highest() < b.highest(); };
    const double level = std::min_element(replicas.begin(), replicas.end(), is_lower)->highest();
    generation_.complete = level == happened;
    if (generation_.complete) return paths;
    const auto first_killed = std::stable_partition(
        replicas.begin(), replicas.end(), [level](const Replica& replica) { return replica.highest() > level; });
    survivors_ = static_cast<std::size_t>(first_killed - replicas.begin());
    ++generation_.levels;
    generation_.weight *= static_cast<double>(survivors_) / static_cast<double>(count_);
    generation_.complete = survivors_ == 0;
    for (std::size_t i = survivors_; i < replicas.size() && survivors_ > 0; ++i) {
      paths.push_back({number_++, &replicas[random_->below(survivors_)], level});
    }
    return paths;
  }

  //! Those paths, in their order.
  void take(std::vector<Replica> made) {
    generation_.replicas.resize(survivors_);
    std::move(made.begin(), made.end(), std::back_inserter(generation_.replicas));
  }

  const Generation<Replica>& generation() const { return generation_; }

 private:
  std::size_t count_;
  Random* random_;
  Generation<Replica> generation_;
  std::size_t number_ = 0;
  std::size_t survivors_ = 0;
};

//! All rounds. `draw(number)` is a path from the start, `branch(parent, level, number)` one of a parent.
template <typename Replica, typename Draw, typename Branch>
Generation<Replica> split(int count, Random& random, const Draw& draw, const Branch& branch) {
  Splitting<Replica> splitting(count, random);
  for (std::vector<Path<Replica>> paths = splitting.next(); !paths.empty(); paths = splitting.next()) {
    std::vector<Replica> made;
    for (const Path<Replica>& path : paths) {
      made.push_back(path.parent ? branch(*path.parent, path.level, path.number) : draw(path.number));
    }
    splitting.take(std::move(made));
  }
  return splitting.generation();
}

//! Relative variance of one estimate: as measured or, if that is more, as of a lognormal distribution with the variance
//! of their logarithms, of which a few draws seldom show the long tail. That variance is itself known to its square
//! times 2 / (n - 1) alone, which counts as well (Cox's interval of a lognormal mean; Zhou and Gao, Statistics in
//! Medicine, 1997).
inline double relative_variance(const Eigen::VectorXd& estimates) {
  const auto n = static_cast<double>(estimates.size());
  const double mean = estimates.mean();
  const double measured = (estimates.array() - mean).square().sum() / (n - 1.0) / (mean * mean);
  std::vector<double> logarithms;
  for (const double estimate : estimates) {
    if (estimate > 0.0) logarithms.push_back(portable::log(estimate));
  }
  const auto positive = static_cast<double>(logarithms.size());
  if (positive < 2.0) return measured;
  const Eigen::Map<const Eigen::ArrayXd> logs(logarithms.data(), static_cast<Eigen::Index>(logarithms.size()));
  const double spread = (logs - logs.mean()).square().sum() / (positive - 1.0);
  const double of_spread = 0.5 * positive * spread * spread / (positive - 1.0);
  return std::max(measured, portable::exp(spread + of_spread) * n / positive - 1.0);
}

//! How many rollouts of equal weight say as much about a rare probability as these estimates: at least as many as the
//! replicas, at most what the best of all levels gives, with a relative variance of -log(p) / replicas.
inline double effective_size(const Eigen::VectorXd& estimates, int replicas) {
  const auto n = static_cast<double>(estimates.size());
  const double mean = estimates.mean();
  if (mean <= 0.0 || mean >= 1.0) return replicas;
  const double of_student = (n - 1.0) / (n - 3.0);  // the variance of Student's distribution
  const double least = -portable::log(mean) / replicas;
  const double variance = std::max(relative_variance(estimates) / n * of_student, least);
  return std::max((1.0 - mean) / mean / variance, static_cast<double>(replicas));
}

}  // namespace energymargin::splitting
