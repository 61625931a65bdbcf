#pragma once
// What probabilities of capture share: when the sets are looked at, and how many rollouts may diverge.

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "energymargin/problem.hpp"

namespace energymargin {

//! Steps after which the sets are looked at, from 0 to the horizon.
inline std::vector<int> looks_of(const Timing& timing) {
  std::vector<int> steps;
  for (int step = 0; step < timing.horizon; step += timing.check) steps.push_back(step);
  steps.push_back(timing.horizon);
  return steps;
}

//! Their times [s].
inline Eigen::VectorXd times_of(const std::vector<int>& steps, double step) {
  Eigen::VectorXd times(static_cast<Eigen::Index>(steps.size()));
  for (std::size_t i = 0; i < steps.size(); ++i) times[static_cast<Eigen::Index>(i)] = step * steps[i];
  return times;
}

//! Throws std::runtime_error if more than one and more than this share have diverged, any if it is 0, or all below 1.
inline void require_few_diverged(int diverged, int rollouts, double most) {
  if (most >= 1.0) return;
  const double allowed = most > 0.0 ? std::max(1.0, most * rollouts) : 0.0;
  if (diverged == 0 || (diverged <= allowed && diverged < rollouts)) return;
  throw std::runtime_error(std::to_string(diverged) + " of " + std::to_string(rollouts) +
                           " rollouts diverged, which is too many for a probability: a shorter step of the scene, "
                           "or a weaker disturbance");
}

}  // namespace energymargin
