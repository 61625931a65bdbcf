// The work of the impulses of a substep.

#include "physics/solver/step_equations.hpp"

namespace energymargin {

void StepEquations::add_work(const Substep& substep, double share) {
  for (const std::size_t k : contact_points_) add_contact_work(substep.contacts[k]);
  add_limited_work();
  add_recovery_work(substep.duration * share);
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    if (trees_[i].prescribed() == 0) continue;
    audit_.work.motors +=
        trees_[i].work_on_base(substep.duration, audit_.before->trees[i].data(), trees_[i].tree().velocities().data());
  }
}

// Each impulse times the mean of the velocities before the substep and after it. A kinematic body keeps none of it:
// what stands against the impulse is its drive.
void StepEquations::add_contact_work(const ContactPoint& point) {
  const btVector3 normal = point.normal * point.normal_impulse;
  const btVector3& friction = point.friction_impulse;
  audit_.work.contacts += normal.dot(mean_velocity(point.a, point.on_a) - mean_velocity(point.b, point.on_b));
  audit_.work.friction += friction.dot(mean_velocity(point.a, point.grip) - mean_velocity(point.b, point.grip));
  audit_.work.motors -=
      normal.dot(prescribed_velocity(point.a, point.on_a) - prescribed_velocity(point.b, point.on_b)) +
      friction.dot(prescribed_velocity(point.a, point.grip) - prescribed_velocity(point.b, point.grip));
}

btVector3 StepEquations::mean_velocity(std::size_t body, const btVector3& point) const {
  if (const auto& tree = bodies_.tree_of(body)) {
    const Articulation& of = *bodies_.trees()[*tree];
    const btCollisionObject& collider = *bodies_.colliders()[body];
    return 0.5 *
           (of.velocity(collider, point, audit_.before->trees[*tree]) + of.velocity(collider, point, of.velocities()));
  }
  if (!is_rigid(body)) return {0, 0, 0};
  const Motion::OfBody& before = audit_.before->bodies[body];
  const btVector3 arm = point - bodies_.colliders()[body]->getWorldTransform().getOrigin();
  return 0.5 * (before.linear + before.angular.cross(arm) + bodies_.velocity(body, point));
}

// What of it a kinematic body, or the kinematic base of its tree, has.
btVector3 StepEquations::prescribed_velocity(std::size_t body, const btVector3& point) const {
  const auto& tree = bodies_.tree_of(body);
  if (!tree) return is_rigid(body) && rigid(body).mover < 0 ? mean_velocity(body, point) : btVector3(0, 0, 0);
  if (trees_[*tree].prescribed() == 0) return {0, 0, 0};
  const Articulation& of = *bodies_.trees()[*tree];
  const double* before = audit_.before->trees[*tree].data();
  const double* after = of.velocities().data();
  return 0.5 * (vector(before) + vector(after) + (vector(before + 3) + vector(after + 3)).cross(point - of.origin()));
}

void StepEquations::add_limited_work() {
  if (kinds_.empty()) return;
  std::vector<double> sums = solver_.all_velocities();
  for (const RigidMover& rigid : rigids_) {
    if (rigid.mover < 0) continue;
    const Motion::OfBody& before = audit_.before->bodies[body_index(*rigid.body)];
    double* const sum = sums.data() + solver_.begin(rigid.mover);
    for (std::size_t row = 0; row < rigid.axes.size(); ++row) {
      const int axis = rigid.axes[row];
      sum[row] += axis < 3 ? before.linear[axis] : before.angular[axis - 3];
    }
  }
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    if (tree_movers_[i] < 0) continue;
    const std::vector<double>& before = audit_.before->trees[i];
    double* const sum = sums.data() + solver_.begin(tree_movers_[i]);
    for (std::size_t k = trees_[i].prescribed(); k < before.size(); ++k) sum[k - trees_[i].prescribed()] += before[k];
  }
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    const LimitedRow& row = solver_.limited()[k];
    const double work = 0.5 * row.impulse * solver_.speed(row, 0, sums);
    if (kinds_[k] == Kind::motor) audit_.work.motors += work;
    if (kinds_[k] == Kind::stop || kinds_[k] == Kind::mimic) audit_.work.joints += work;
  }
}

// Recovery moves bodies and leaves their velocities alone.
void StepEquations::add_recovery_work(double duration) {
  for (const RigidMover& rigid : rigids_) {
    if (rigid.mover < 0) continue;
    const Motion::OfBody& loaded = audit_.before->bodies[body_index(*rigid.body)];
    const double* recovery = solver_.recovery(rigid.mover);
    for (std::size_t row = 0; row < rigid.axes.size(); ++row) {
      const int axis = rigid.axes[row];
      audit_.work.overlap -= (axis < 3 ? loaded.force[axis] : loaded.torque[axis - 3]) * recovery[row] * duration;
    }
  }
}

}  // namespace energymargin
