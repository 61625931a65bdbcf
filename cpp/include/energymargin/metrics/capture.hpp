#pragma once
// Capture score and success score, Section IV-B and Algorithm 2.

#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"

namespace energymargin {

struct CaptureOptions {
  int nodes = 1000;  //!< M, nodes of a tree besides its root
  std::uint64_t seed = 0;
  std::optional<double> rate{};             //!< lambda [1/J]; unset: the problem's
  int trees = 1;                            //!< independent trees; 2 or more give standard errors
  int threads = 1;                          //!< for several trees
  const std::atomic<bool>* stop = nullptr;  //!< set from another thread: the search ends early
};

struct CaptureScore {
  double capture = 0.0;                 //!< Omega_cap, eq. 5, mean over the trees; of several objects: that all stay
  std::optional<double> success{};      //!< Omega_suc, eq. 6; unset without a success set; of several objects: of all
  std::optional<double> capture_any{};  //!< of several objects at least one; unset without such a set
  std::optional<double> success_any{};
  std::optional<double> capture_stderr{};  //!< standard errors; unset for a single tree
  std::optional<double> success_stderr{};
  std::optional<double> capture_any_stderr{};
  std::optional<double> success_any_stderr{};
  std::vector<Tree> trees;
  Eigen::VectorXd likelihoods;  //!< of the first tree's nodes, eq. 4; they add up to 1
};

//! Likelihood of each node, eq. 4: a softmax of -rate * cost, shifted by the least cost so that nothing overflows.
Eigen::VectorXd likelihoods(const Eigen::VectorXd& costs, double rate);

//! Throws std::invalid_argument on a bad problem or option.
CaptureScore capture_score(const Problem& problem, const CaptureOptions& options = {});

}  // namespace energymargin
