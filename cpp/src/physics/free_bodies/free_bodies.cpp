#include "physics/free_bodies/free_bodies.hpp"

namespace energymargin {

void FreeBodies::solve(double duration, btContactSolverInfo& info) {
  info.m_timeStep = duration;
  solver_.solve(moving_, pairs().touching(), motors(), info);
}

void FreeBodies::read(std::vector<Velocity>& velocities) const { read_velocities(moving_, velocities); }

void FreeBodies::move(double duration, double share) { energymargin::move(moving_, duration, share); }

}  // namespace energymargin
