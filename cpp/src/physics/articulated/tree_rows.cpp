#include "physics/articulated/tree_rows.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace energymargin {
namespace {

double squared(double value) { return value * value; }

}  // namespace

inline double TreeRows::Side::speed() const {
  if (body) {
    return linear.dot(body->internalGetDeltaLinearVelocity()) + angular.dot(body->internalGetDeltaAngularVelocity());
  }
  double sum = 0.0;
  for (int i = nonzero_jacobian.begin; i < nonzero_jacobian.begin + nonzero_jacobian.count; ++i)
    sum += jacobian[i] * changes[i];
  return sum;
}

inline void TreeRows::Side::push(double impulse) const {
  if (body) {
    body->internalApplyImpulse(linear_change, angular_change, impulse);
    return;
  }
  for (int i = nonzero_response.begin; i < nonzero_response.begin + nonzero_response.count; ++i)
    changes[i] += response[i] * impulse;
}

inline double TreeRows::Row::unclamped_change() const {
  double change = target - impulse * softness;
  change -= a.speed() * effective_mass;
  change -= b.speed() * effective_mass;
  return change;
}

inline void TreeRows::Row::push(double impulse_) const {
  a.push(impulse_);
  b.push(impulse_);
}

void TreeRows::start(Constraints& joints, Constraints& normal, Constraints& friction, btMultiBodyJacobianData& data,
                     btAlignedObjectArray<btSolverBody>& bodies) {
  data_ = &data;
  bodies_ = &bodies;
  trees_.clear();
  at_start_.clear();
  for (const auto& [rows, constraints] :
       {std::tuple{&joints_, &joints}, std::tuple{&normal_, &normal}, std::tuple{&friction_, &friction}}) {
    rows->clear();
    for (int i = 0; i < constraints->size(); ++i) rows->push_back(row((*constraints)[i]));
  }
}

TreeRows::Row TreeRows::row(btMultiBodySolverConstraint& from) {
  Row row{&from,
          side(from.m_solverBodyIdA, from.m_multiBodyA, from.m_jacAindex, from.m_deltaVelAindex),
          side(from.m_solverBodyIdB, from.m_multiBodyB, from.m_jacBindex, from.m_deltaVelBindex),
          from.m_rhs,
          from.m_jacDiagABInv,
          from.m_cfm,
          from.m_appliedImpulse,
          from.m_lowerLimit,
          from.m_upperLimit};
  const auto place = [](Side& side, const btVector3& linear, const btVector3& angular, const btVector3& change) {
    if (!side.body) return;
    side.linear = linear;
    side.angular = angular;
    side.linear_change = linear * side.body->internalGetInvMass();
    side.angular_change = change;
  };
  place(row.a, from.m_contactNormal1, from.m_relpos1CrossNormal, from.m_angularComponentA);
  place(row.b, from.m_contactNormal2, from.m_relpos2CrossNormal, from.m_angularComponentB);
  return row;
}

TreeRows::Side TreeRows::side(int solver_body, btMultiBody* tree, int jacobian, int changes) {
  Side side;
  if (!tree) {
    if (solver_body >= 0 && (*bodies_)[solver_body].m_originalBody) side.body = &(*bodies_)[solver_body];
    return side;
  }
  const int count = tree->getNumDofs() + 6;
  side.jacobian = &data_->m_jacobians[jacobian];
  side.response = &data_->m_deltaVelocitiesUnitImpulse[jacobian];
  side.changes = &data_->m_deltaVelocities[changes];
  save_changes(*tree, side.changes);
  const auto span = [count](const double* numbers) {
    const auto not_zero = [](double number) { return number != 0.0; };
    const double* const first = std::find_if(numbers, numbers + count, not_zero);
    const double* last = numbers + count;
    while (last > first && last[-1] == 0.0) --last;
    return Span{static_cast<int>(first - numbers), static_cast<int>(last - first)};
  };
  side.nonzero_jacobian = span(side.jacobian);
  side.nonzero_response = span(side.response);
  return side;
}

double TreeRows::iterate(int round, int joint_rounds) {
  double most_of_joints = 0.0;
  for (int i = 0; i < joint_rounds; ++i) {
    most_of_joints = 0.0;
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      Row& row = joints_[round % 2 == 1 ? j : joints_.size() - 1 - j];
      most_of_joints = std::max(most_of_joints, squared(resolve(row)));
    }
  }
  double most = most_of_joints;
  for (Row& row : normal_) most = std::max(most, squared(resolve(row)));
  for (std::size_t i = 0; i + 1 < friction_.size(); i += 2) {
    const btMultiBodySolverConstraint& constraint = *friction_[i].constraint;
    const double radius = constraint.m_friction * normal_[static_cast<std::size_t>(constraint.m_frictionIndex)].impulse;
    most = std::max(most, resolve_cone(friction_[i], friction_[i + 1], radius));
  }
  return most;
}

// Returns the change of the velocity along the row.
double TreeRows::resolve(Row& row) {
  double change = row.unclamped_change();
  const double unclamped = row.impulse + change;
  if (unclamped < row.low) {
    change = row.low - row.impulse;
    row.impulse = row.low;
  } else if (unclamped > row.high) {
    change = row.high - row.impulse;
    row.impulse = row.high;
  } else {
    row.impulse = unclamped;
  }
  row.push(change);
  return change / row.effective_mass;
}

// The two impulses stay within a circle. Returns the square of the change of the velocity along both.
double TreeRows::resolve_cone(Row& first, Row& second, double radius) {
  double change_second = second.unclamped_change();
  double change_first = first.unclamped_change();
  const double unclamped_first = first.impulse + change_first;
  const double unclamped_second = second.impulse + change_second;
  const auto limit = [](Row& row, double unclamped, double most, double& change) {
    const double clamped = std::min(std::max(unclamped, -most), most);
    if (clamped != unclamped) change = clamped - row.impulse;
    row.impulse = clamped;
  };
  const double length = std::sqrt(squared(unclamped_first) + squared(unclamped_second));
  if (length >= radius) {
    const double share = length > 0.0 ? radius / length : 0.0;
    limit(first, unclamped_first, std::abs(share * unclamped_first), change_first);
    limit(second, unclamped_second, std::abs(share * unclamped_second), change_second);
  } else {
    first.impulse = unclamped_first;
    second.impulse = unclamped_second;
  }
  first.push(change_first);
  second.push(change_second);
  return squared(change_first / first.effective_mass) + squared(change_second / second.effective_mass);
}

void TreeRows::finish() {
  for (auto* rows : {&joints_, &normal_, &friction_}) {
    for (const Row& row : *rows) row.constraint->m_appliedImpulse = row.impulse;
  }
  // A tree keeps changes of its own, as they were at the start. It knows only how to add: this sets them.
  for (const Tree& tree : trees_) {
    tree.body->applyDeltaVeeMultiDof2(&at_start_[tree.at_start], -1.0);
    tree.body->applyDeltaVeeMultiDof2(tree.changes, 1.0);
    tree.body->setPosUpdated(false);
  }
}

void TreeRows::save_changes(btMultiBody& tree, const double* changes) {
  const auto same = [&](const Tree& other) { return other.body == &tree; };
  if (std::any_of(trees_.begin(), trees_.end(), same)) return;
  trees_.push_back({&tree, changes, at_start_.size()});
  at_start_.insert(at_start_.end(), changes, changes + tree.getNumDofs() + 6);
}

}  // namespace energymargin
