// The work of the impulses of a substep.

#include "physics/solver/step_equations.hpp"

namespace energymargin {

void StepEquations::add_work(const Substep& substep, double share) {
  for (const std::size_t k : contact_points_) add_contact_work(substep.contacts[k]);
  add_limited_work();
  add_recovery_work(substep.duration * share);
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    if (tree(i).prescribed() > 0) audit.work.plan += tree(i).work_on_base(substep.duration, audit.before->trees[i]);
  }
}

// Each impulse times the mean of the velocities before the substep and after it. A kinematic body keeps none of it:
// what stands against the impulse is its drive.
void StepEquations::add_contact_work(const ContactPoint& point) {
  const btVector3 normal = point.normal * point.normal_impulse;
  const btVector3& friction = point.friction_impulse;
  audit.work.contacts += normal.dot(mean_velocity(point.a, point.on_a) - mean_velocity(point.b, point.on_b));
  audit.work.friction += friction.dot(mean_velocity(point.a, point.grip) - mean_velocity(point.b, point.grip));
  audit.work.plan -= normal.dot(prescribed_velocity(point.a, point.on_a) - prescribed_velocity(point.b, point.on_b)) +
                     friction.dot(prescribed_velocity(point.a, point.grip) - prescribed_velocity(point.b, point.grip));
}

btVector3 StepEquations::mean_velocity(std::size_t body, const btVector3& point) const {
  if (const auto& link = bodies_.link(body)) {
    const btVector3 before = tree(link->tree).velocity(link->link, point, audit.before->trees[link->tree]);
    return 0.5 * (before + bodies_.velocity(body, point));
  }
  if (!bodies_.free(body)) return {0, 0, 0};
  const Velocity& before = audit.before->bodies[body].velocity;
  const btVector3 arm = point - bodies_.poses()[body].getOrigin();
  return 0.5 * (before.linear + before.angular.cross(arm) + bodies_.velocity(body, point));
}

// What of it a kinematic body, or the kinematic base of its tree, has.
btVector3 StepEquations::prescribed_velocity(std::size_t body, const btVector3& point) const {
  const FreeBody* free = bodies_.free(body);
  if (free && free->kinematic) return mean_velocity(body, point);
  const auto& link = bodies_.link(body);
  if (!link || tree(link->tree).prescribed() == 0) return {0, 0, 0};
  Articulation& of = tree(link->tree);
  const double* before = audit.before->trees[link->tree].data();
  const double* after = of.velocities().data();
  return 0.5 * (vector(before) + vector(after) + (vector(before + 3) + vector(after + 3)).cross(point - of.origin()));
}

void StepEquations::add_limited_work() {
  if (solver_.limited().empty()) return;
  std::vector<double> sums = solver_.all_velocities();
  for (const FreeBody& body : bodies_.free()) {
    for (std::size_t row = 0; row < body.axes.size(); ++row) {
      sums[solver_.begin(body.mover) + row] += audit.before->bodies[body.body].velocity[body.axes[row]];
    }
  }
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    if (trees_[i].mover < 0) continue;
    const std::vector<double>& before = audit.before->trees[i];
    double* const sum = sums.data() + solver_.begin(trees_[i].mover);
    for (std::size_t k = tree(i).prescribed(); k < before.size(); ++k) sum[k - tree(i).prescribed()] += before[k];
  }
  for (const LimitedRow& row : solver_.limited()) {
    if (row.work) *row.work += 0.5 * row.impulse * solver_.speed(row, 0, sums);
  }
}

// Recovery moves bodies and leaves their velocities alone.
void StepEquations::add_recovery_work(double duration) {
  for (const FreeBody& body : bodies_.free()) {
    const Motion::OfBody& loaded = audit.before->bodies[body.body];
    for (std::size_t row = 0; row < body.axes.size(); ++row) {
      const int axis = body.axes[row];
      const double load = axis < 3 ? loaded.force[axis] : loaded.torque[axis - 3];
      audit.work.overlap -= load * solver_.recovery(body.mover)[row] * duration;
    }
  }
}

}  // namespace energymargin
