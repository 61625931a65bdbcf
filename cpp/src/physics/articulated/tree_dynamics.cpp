#include "physics/articulated/tree_dynamics.hpp"

#include <algorithm>

namespace energymargin {

TreeDynamics::TreeDynamics(Articulation& tree)
    : tree_(tree),
      count_(tree.velocities().size()),
      size_(count_ + count_ % 2),
      links_(count_, 0),
      inertia_(size_ * size_, 0.0),
      inverse_(size_ * size_, 0.0),
      forces_(count_),
      rates_(size_, 0.0),
      bodies_(tree.links().size()),
      accelerations_(tree.links().size()),
      link_forces_(tree.links().size()) {
  for (std::size_t i = 1; i < tree.links().size(); ++i) {
    const int velocity = tree.links()[i].velocity;
    if (velocity >= 0) links_[static_cast<std::size_t>(velocity)] = static_cast<int>(i);
  }
}

void TreeDynamics::update(const btVector3& gravity) {
  std::copy_n(tree_.velocities().begin(), prescribed(), base_.begin());
  add_bodies(gravity);
  const std::vector<SpatialVector>& motions = tree_.motions();
  for (std::size_t i = 0; i < count_; ++i) {
    const auto link = static_cast<std::size_t>(links_[i]);
    forces_[i] = -motions[i].dot(link_forces_[link]);
    const SpatialVector momentum = bodies_[link] * motions[i];
    for (int j = static_cast<int>(i); j >= 0; j = tree_.above(j)) {
      const auto above = static_cast<std::size_t>(j);
      inertia_[i * size_ + above] = inertia_[above * size_ + i] = motions[above].dot(momentum);
    }
    inertia_[i * size_ + i] += tree_.links()[link].armature;
  }
}

void TreeDynamics::drive_base(const btVector3& linear, const btVector3& angular) {
  for (int axis = 0; axis < 3; ++axis) {
    base_[static_cast<std::size_t>(axis)] = linear[axis];
    base_[static_cast<std::size_t>(3 + axis)] = angular[axis];
  }
}

// The force on each link, and all that hangs on it, that keeps its velocities constant. A free base moves in a straight
// line then: what is at the common point is another point of it in each moment, which makes an acceleration.
void TreeDynamics::add_bodies(const btVector3& gravity) {
  const std::vector<Articulation::Link>& links = tree_.links();
  const std::vector<SpatialVector>& link_motions = tree_.link_motions();
  accelerations_[0] = {btVector3(0, 0, 0), link_motions[0].linear.cross(link_motions[0].angular)};
  for (std::size_t i = 0; i < links.size(); ++i) {
    const Articulation::Link& link = links[i];
    if (link.last_velocity < 0) continue;
    const SpatialVector& motion = link_motions[i];
    const btVector3 arm = link.pose.getOrigin() - tree_.origin();
    if (link.joint) accelerations_[i] = accelerations_[static_cast<std::size_t>(link.parent)];
    if (link.joint && link.velocity >= 0) {
      const auto velocity = static_cast<std::size_t>(link.velocity);
      accelerations_[i] += motion.cross_motion(tree_.motions()[velocity] * tree_.velocities()[velocity]);
    }
    bodies_[i] = SpatialInertia(link.mass, link.moments, link.pose.getBasis(), arm);
    const btVector3 force = link.force + gravity * link.mass;
    link_forces_[i] = bodies_[i] * accelerations_[i] + motion.cross_force(bodies_[i] * motion) -
                      SpatialVector{arm.cross(force) + link.torque, force};
  }
  for (std::size_t i = links.size() - 1; i > 0; --i) {
    const auto parent = static_cast<std::size_t>(links[i].parent);
    if (links[parent].last_velocity < 0) continue;
    bodies_[parent] += bodies_[i];
    link_forces_[parent] += link_forces_[i];
  }
}

void TreeDynamics::start(double duration, double* velocities) {
  inverse_ = inertia_;
  for (std::size_t i = 0; i < count_; ++i) rates_[i] = duration * forces_[i];
  for (const JointControl& control : tree_.controls()) {
    if (!control.drives() || control.at_limit) continue;
    const auto i = static_cast<std::size_t>(control.velocity);
    const double position = tree_.links()[static_cast<std::size_t>(control.link)].position;
    inverse_[i * size_ + i] += control.resistance(duration);
    rates_[i] += control.pull(duration, position) - control.resistance(duration) * tree_.velocities()[i];
  }
  add_base_changes();
  invert();
  for (std::size_t i = 0; i < prescribed(); ++i) inverse_[i * size_ + i] = 0.0;
  respond(rates_.data(), velocities);
  for (std::size_t i = 0; i < count_; ++i) velocities[i] += tree_.velocities()[i];
  std::copy_n(base_.begin(), prescribed(), velocities);
}

// A kinematic base has no rates of its own; what it changes by, the joints feel.
void TreeDynamics::add_base_changes() {
  for (std::size_t i = 0; i < prescribed(); ++i) {
    const double change = base_[i] - tree_.velocities()[i];
    for (std::size_t j = prescribed(); j < count_; ++j) rates_[j] -= inertia_[j * size_ + i] * change;
    for (std::size_t j = 0; j < count_; ++j) inverse_[i * size_ + j] = inverse_[j * size_ + i] = 0.0;
    inverse_[i * size_ + i] = 1.0;
    rates_[i] = 0.0;
  }
}

double TreeDynamics::work_on_base(double duration, const double* before, const double* after) const {
  double work = 0.0;
  for (std::size_t i = 0; i < prescribed(); ++i) {
    double impulse = -duration * forces_[i];
    for (std::size_t j = 0; j < count_; ++j) impulse += inertia_[i * size_ + j] * (after[j] - before[j]);
    work += 0.5 * (before[i] + after[i]) * impulse;
  }
  return work;
}

// Gauss and Jordan's way; an inertia needs no pivots.
void TreeDynamics::invert() {
  double* const m = inverse_.data();
  for (std::size_t k = 0; k < count_; ++k) {
    const double inverse = 1.0 / m[k * size_ + k];
    m[k * size_ + k] = 1.0;
    for (std::size_t j = 0; j < count_; ++j) m[k * size_ + j] *= inverse;
    for (std::size_t i = 0; i < count_; ++i) {
      const double factor = m[i * size_ + k];
      if (i == k || factor == 0.0) continue;
      m[i * size_ + k] = 0.0;
      for (std::size_t j = 0; j < count_; ++j) m[i * size_ + j] -= factor * m[k * size_ + j];
    }
  }
}

void TreeDynamics::respond(const double* impulses, double* changes) const {
  for (std::size_t i = 0; i < size_; ++i) changes[i] = 0.0;
  for (std::size_t j = 0; j < count_; ++j) {
    if (impulses[j] == 0.0) continue;
    const double* column = inverse_.data() + j * size_;
    for (std::size_t i = 0; i < size_; ++i) changes[i] += impulses[j] * column[i];
  }
}

void TreeDynamics::add(int link, const btVector3& point, const btVector3& impulse, double* impulses) const {
  const SpatialVector at_origin{(point - tree_.origin()).cross(impulse), impulse};
  const std::vector<SpatialVector>& motions = tree_.motions();
  for (int i = tree_.links()[static_cast<std::size_t>(link)].last_velocity; i >= 0; i = tree_.above(i)) {
    impulses[i] += motions[static_cast<std::size_t>(i)].dot(at_origin);
  }
}

}  // namespace energymargin
