#pragma once
// Capture score and success score, Section IV-B and Algorithm 2.

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/plausibility.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"
#include "energymargin/world.hpp"

namespace energymargin {

//! The fewest trees of a tolerance: fewer may agree by chance (docs/results/uncertainty.md). And the most by default.
inline constexpr int fewest_trees = 8;
inline constexpr int most_trees = 1000;

struct CaptureOptions {
  int nodes = 1000;               //!< M, nodes of a tree besides its root
  int nodes_per_edge = 1;         //!< the most states of a rollout that are nodes: its end, and evenly spaced ones
  int nodes_per_round = 1;        //!< nodes that are extended at once, at most as many as there are
  double least_likelihood = 0.0;  //!< share of the root's likelihood, exp(-rate cost), at which a rollout ends for good
  std::uint64_t seed = 0;
  std::optional<double> rate{};       //!< lambda [1/J]; unset: the problem's
  std::optional<int> trees{};         //!< independent trees, the most with a tolerance; unset: 1, or `most_trees`
  int threads = 1;                    //!< for trees, and for rounds of nodes; the score does not depend on it
  std::optional<double> tolerance{};  //!< trees are added until every standard error is at most this
  Limit limit{};                      //!< ends the search early; the trees that are complete count
  std::atomic<int>* node_counter = nullptr;  //!< goes up with each node of all trees, for a bar of progress
  bool check_undisturbed = false;            //!< of a high score, also when the state leaves without a disturbance
};

//! The likelihood of one set, over independent trees.
struct SetScore {
  double mean = 0.0;                       //!< over the trees, 0..1
  std::optional<double> standard_error{};  //!< of the mean; unset for a single tree
  Eigen::VectorXd by_tree{};               //!< of each tree alone, shape (trees,)
};

//! Its steps are those of all trees' rollouts, but for those that diverged.
struct CaptureScore : StepCounts {
  SetScore capture;                       //!< Omega_cap, eq. 5; of several objects: all are captured
  std::optional<SetScore> success{};      //!< Omega_suc, eq. 6; unset without a success set
  std::optional<SetScore> capture_any{};  //!< of several objects at least one is captured; unset without such a set
  std::optional<SetScore> success_any{};  //!< of several objects at least one has succeeded; unset without such a set
  double resolution = 0.0;                //!< likelihood of a tree's heaviest node, mean over the trees
  std::optional<double> undisturbed_exit{};  //!< time of the exit without disturbance [s], if that was checked
  std::vector<Tree> trees{};
  Eigen::VectorXd likelihoods{};    //!< of the first tree's nodes, eq. 4, shape (M + 1,); the sum is 1
  int diverged = 0;                 //!< rollouts of all trees that diverged: nodes of infinite cost and no likelihood
  bool complete = true;             //!< no tree is missing; with a tolerance, the standard errors meet it
  std::vector<Warning> warnings{};  //!< what speaks against the score

  //! Of each tree, besides its root.
  int nodes() const { return trees.front().size() - 1; }
};

//! The scores by name, null without such a set: "capture", "success", "capture_any", "success_any".
std::array<std::pair<std::string_view, const SetScore*>, 4> set_scores(const CaptureScore& score);

//! Likelihood of each node, eq. 4: a softmax of -rate * cost, shifted by the least cost so that nothing overflows.
Eigen::VectorXd likelihoods(const Eigen::VectorXd& costs, double rate);

//! Throws std::invalid_argument unless `value` is at least 0 and below 1.
void require_least_likelihood(double value);

//! Algorithm 2, on independent trees. At its limit it scores the complete trees up to the first that is not, or else
//! the first tree as far as it is. Throws std::invalid_argument on a bad problem or option.
CaptureScore capture_score(const Problem& problem, const CaptureOptions& options = {});

}  // namespace energymargin
