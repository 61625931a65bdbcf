#pragma once
// Capture score and success score, Section IV-B and Algorithm 2.

#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"

namespace energymargin {

//! With a tolerance: fewest trees, since a few may agree by chance (docs/results/uncertainty.md), and most, unless
//! given.
inline constexpr int fewest_trees = 8;
inline constexpr int most_trees = 1000;

struct CaptureOptions {
  int nodes = 1000;        //!< M, nodes of a tree besides its root
  int nodes_per_edge = 1;  //!< up to so many states of a rollout are nodes: its end, and evenly spaced ones on its way
  double least_likelihood = 0.0;  //!< beside the root's: a rollout ends where exp(-rate cost) falls to it, for good
  std::uint64_t seed = 0;
  std::optional<double> rate{};       //!< lambda [1/J]; unset: the problem's
  std::optional<int> trees{};         //!< independent trees, at most if there is a tolerance; unset: 1, or `most_trees`
  int threads = 1;                    //!< for several trees; the score does not depend on it
  std::optional<double> tolerance{};  //!< trees are added until every standard error is at most this
  Limit limit{};                      //!< ends the search early; the trees that are complete count
  std::atomic<int>* made = nullptr;   //!< goes up with each node of all trees, for a bar of progress; null: not counted
};

//! Scores of independent trees: what they say together.
struct CaptureScore {
  double capture = 0.0;                 //!< Omega_cap, eq. 5, mean over the trees; of several objects: that all stay
  std::optional<double> success{};      //!< Omega_suc, eq. 6; unset without a success set; of several objects: of all
  std::optional<double> capture_any{};  //!< of several objects at least one; unset without such a set
  std::optional<double> success_any{};
  std::optional<double> capture_stderr{};  //!< standard errors; unset for a single tree
  std::optional<double> success_stderr{};
  std::optional<double> capture_any_stderr{};
  std::optional<double> success_any_stderr{};
  Eigen::VectorXd capture_by_tree;  //!< of each tree alone; empty without such a set
  Eigen::VectorXd success_by_tree;
  Eigen::VectorXd capture_any_by_tree;
  Eigen::VectorXd success_any_by_tree;
  double resolution = 0.0;  //!< likelihood of a tree's heaviest node, mean over the trees: no score is finer
  std::optional<double> undisturbed_exit{};  //!< when it leaves by itself [s], where guards.hpp looked at that
  std::vector<Tree> trees;
  Eigen::VectorXd likelihoods;  //!< of the first tree's nodes, eq. 4; they add up to 1
  int diverged = 0;             //!< rollouts that diverged, of all trees: nodes of infinite cost and no likelihood
  bool complete = true;         //!< all trees are grown; with a tolerance, as many as it takes

  //! Of each tree, besides its root.
  int nodes() const { return trees.front().size() - 1; }
};

//! Likelihood of each node, eq. 4: a softmax of -rate * cost, shifted by the least cost so that nothing overflows.
Eigen::VectorXd likelihoods(const Eigen::VectorXd& costs, double rate);

//! Throws std::invalid_argument unless it is at least 0 and below 1.
void require_least_likelihood(double value);

//! A search that reaches its limit counts the complete trees up to the first that is not; if there is none, the first
//! tree as far as it is. Throws std::invalid_argument on a bad problem or option.
CaptureScore capture_score(const Problem& problem, const CaptureOptions& options = {});

}  // namespace energymargin
