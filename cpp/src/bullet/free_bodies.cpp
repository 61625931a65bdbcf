#include "free_bodies.hpp"

namespace energymargin {

void FreeBodies::step(double duration, btContactSolverInfo& info) {
  pairs_.update();
  info.m_timeStep = duration;
  solver_.solve(moving_, pairs_.touching(), info);
  for (btRigidBody* body : moving_) {
    btTransform moved;
    body->predictIntegratedTransform(duration, moved);
    body->proceedToTransform(moved);
  }
}

}  // namespace energymargin
