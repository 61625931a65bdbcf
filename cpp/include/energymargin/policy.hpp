#pragma once
// A robot that is asked what to do.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/types.hpp"

namespace energymargin {

//! What a policy is asked at one control time of many rollouts.
struct PolicyQuestion {
  double time = 0.0;                        //!< since the policy began [s]
  int number = 0;                           //!< of the control time, from 0
  const States& observations;               //!< a row a rollout: of named numbers, or else whole states
  const std::vector<std::uint64_t>& seeds;  //!< of each rollout's own noise; empty: it has none
  const Limit& limit;                       //!< once it is reached, nobody waits for the answer
};

//! Rollouts go on together from one control time to the next, and are asked about in blocks of `block` rows, so that
//! the bits of an answer depend neither on how many there are nor on threads. What it commands and when is in the
//! Feedback of its plan. A file has its name in place of its code.
struct Policy {
  static constexpr int block = 32;

  std::string name;         //!< by which files know its code; empty: they refuse it
  Eigen::VectorXd noise{};  //!< standard deviations, one an observation or one for all, that `act` adds
  Eigen::Index memory = 0;  //!< numbers that a rollout remembers from one control time to the next; at first zeros

  //! False if the limit was reached before it answered.
  std::function<bool(const PolicyQuestion&, States& memory, States& actions)> act;
};

}  // namespace energymargin
