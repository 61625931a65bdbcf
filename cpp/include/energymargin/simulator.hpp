#pragma once
// An engine of others: it plays rollouts in batches, and all that it knows of one is numbers behind the scene's.

#include <functional>
#include <string>
#include <vector>

#include "energymargin/limit.hpp"
#include "energymargin/scene.hpp"
#include "energymargin/types.hpp"

namespace energymargin {

//! What a simulator is asked: rollouts, a row each, that go on together by whole steps.
struct SimulatorQuestion {
  const States& states;    //!< (n, d), of the scene
  const States& memory;    //!< (n, h), the simulator's own
  const States& pushes;    //!< (n steps, 6 k): in each step of each rollout a wrench on each object [N, N m]
  const States& commands;  //!< (n steps, m)
  const std::vector<std::string>& commanded;  //!< names of m commands; the others stay what they are
  int steps = 1;
  int every = 1;  //!< steps from one state that is asked for to the next; a divisor of `steps`
  const Limit& limit;
};

//! What it answers. States that are not finite are those of a rollout that diverged.
struct SimulatorAnswer {
  States states;  //!< (n steps / every, d)
  States memory;  //!< (n, h), after the last step
  States work;    //!< (n steps, k): of each object's push in each step [J]
};

//! It is shared by the threads that ask it. A file does not have it.
struct Simulator {
  //! What the targets of a plan and the commands of a policy name in place of joints; `target` is what it is at first.
  struct Command : PositionControl {
    std::string name;
  };

  std::string name;         //!< which errors call it by
  std::string digest;       //!< another one for another simulator
  double step = 0.0;        //!< [s]
  Eigen::Index memory = 0;  //!< h
  std::vector<Command> commands{};

  //! The numbers behind states that are set from outside, (n, h).
  std::function<States(const States& states)> start;

  //! False if the limit was reached before it answered.
  std::function<bool(const SimulatorQuestion&, SimulatorAnswer&)> play;
};

}  // namespace energymargin
