#include "physics/bodies/tree_dynamics.hpp"

#include <algorithm>
#include <cmath>

namespace energymargin {
namespace {

// Where velocities change by less than this share of themselves as the tree coasts, their mean is as good as any.
constexpr double steady = 1e-5;

}  // namespace

TreeDynamics::TreeDynamics(Articulation& tree)
    : tree_(tree),
      count_(tree.velocities().size()),
      links_(count_, 0),
      inertia_(count_ * count_, 0.0),
      driven_(count_ * count_, 0.0),
      factors_(count_ * count_, 0.0),
      forces_(count_),
      bias_(count_),
      rates_(count_),
      coasting_(count_),
      kicked_(count_),
      bodies_(tree.links().size()),
      composites_(tree.links().size()),
      accelerations_(tree.links().size()),
      link_forces_(tree.links().size()) {
  for (std::size_t i = 1; i < tree.links().size(); ++i) {
    const int velocity = tree.links()[i].velocity;
    if (velocity >= 0) links_[static_cast<std::size_t>(velocity)] = static_cast<int>(i);
  }
  for (const JointControl& control : tree.controls()) drives_ = drives_ || control.drives();
}

void TreeDynamics::keep_base() { std::copy_n(tree_.velocities().begin(), prescribed(), base_.begin()); }

void TreeDynamics::drive_base(const btVector3& linear, const btVector3& angular) {
  for (int axis = 0; axis < 3; ++axis) {
    base_[static_cast<std::size_t>(axis)] = linear[axis];
    base_[static_cast<std::size_t>(3 + axis)] = angular[axis];
  }
}

void TreeDynamics::prepare(double duration, const btVector3& gravity, bool alone) {
  find_inertia();
  find_forces(alone ? btVector3(0, 0, 0) : gravity, true);
  coasting_gravity_ = alone ? gravity : btVector3(0, 0, 0);
  kick(duration);
  find_bias(tree_.velocities());
  for (std::size_t i = 0; i < count_; ++i) coasting_[i] = -bias_[i];
  accelerate(factors_, coasting_);
  if (coupled_) {
    for (std::size_t i = 0; i < count_; ++i) kicked_[i] += duration * coasting_[i];
    std::fill(coasting_.begin(), coasting_.end(), 0.0);
  }
  find_accelerations();
}

void TreeDynamics::find_inertia() {
  const std::vector<Articulation::Link>& links = tree_.links();
  for (std::size_t i = 0; i < links.size(); ++i) {
    const Articulation::Link& link = links[i];
    if (link.last_velocity < 0) continue;
    bodies_[i] = SpatialInertia(link.mass, link.moments, link.pose.getBasis(), link.pose.getOrigin() - tree_.origin());
    composites_[i] = bodies_[i];
  }
  for (std::size_t i = links.size() - 1; i > 0; --i) {
    const auto parent = static_cast<std::size_t>(links[i].parent);
    if (links[parent].last_velocity >= 0) composites_[parent] += composites_[i];
  }
  const std::vector<SpatialVector>& motions = tree_.motions();
  for (std::size_t i = 0; i < count_; ++i) {
    const auto link = static_cast<std::size_t>(links_[i]);
    const SpatialVector momentum = composites_[link] * motions[i];
    for (int j = static_cast<int>(i); j >= 0; j = tree_.above(j)) {
      const auto above = static_cast<std::size_t>(j);
      inertia_[i * count_ + above] = inertia_[above * count_ + i] = motions[above].dot(momentum);
    }
    inertia_[i * count_ + i] += links[link].armature;
  }
}

// Along the velocities, of gravity and maybe loads.
void TreeDynamics::find_forces(const btVector3& gravity, bool loads) {
  const std::vector<Articulation::Link>& links = tree_.links();
  for (std::size_t i = 0; i < links.size(); ++i) {
    btVector3 force = gravity * links[i].mass;
    if (loads) force += links[i].force;
    const btVector3 arm = links[i].pose.getOrigin() - tree_.origin();
    link_forces_[i] = {arm.cross(force), force};
    if (loads) link_forces_[i].angular += links[i].torque;
  }
  for (std::size_t i = links.size() - 1; i > 0; --i) {
    link_forces_[static_cast<std::size_t>(links[i].parent)] += link_forces_[i];
  }
  for (std::size_t i = 0; i < count_; ++i) {
    forces_[i] = tree_.motions()[i].dot(link_forces_[static_cast<std::size_t>(links_[i])]);
  }
}

// The force on each link, and all that hangs on it, that keeps its velocities constant. A free base moves in a straight
// line then: what is at the common point is another point of it in each moment, which makes an acceleration.
void TreeDynamics::find_bias(const std::vector<double>& velocities) {
  const std::vector<Articulation::Link>& links = tree_.links();
  const std::vector<SpatialVector>& motions = motions_ = tree_.link_motions(velocities);
  accelerations_[0] = {btVector3(0, 0, 0), motions[0].linear.cross(motions[0].angular)};
  for (std::size_t i = 0; i < links.size(); ++i) {
    const Articulation::Link& link = links[i];
    if (link.last_velocity < 0) {
      accelerations_[i] = {};
      continue;
    }
    if (link.joint) accelerations_[i] = accelerations_[static_cast<std::size_t>(link.parent)];
    if (link.joint && link.velocity >= 0) {
      const auto velocity = static_cast<std::size_t>(link.velocity);
      accelerations_[i] += motions[i].cross_motion(tree_.motions()[velocity] * velocities[velocity]);
    }
    link_forces_[i] = bodies_[i] * accelerations_[i] + motions[i].cross_force(bodies_[i] * motions[i]);
  }
  for (std::size_t i = links.size() - 1; i > 0; --i) {
    const auto parent = static_cast<std::size_t>(links[i].parent);
    if (links[parent].last_velocity >= 0) link_forces_[parent] += link_forces_[i];
  }
  for (std::size_t i = 0; i < count_; ++i) {
    bias_[i] = tree_.motions()[i].dot(link_forces_[static_cast<std::size_t>(links_[i])]);
  }
}

// A kinematic base has no rates of its own; what it changes by, the joints feel.
void TreeDynamics::kick(double duration) {
  driven_ = inertia_;
  for (std::size_t i = 0; i < count_; ++i) rates_[i] = duration * forces_[i];
  for (const JointControl& control : tree_.controls()) {
    if (!control.drives() || control.limited()) continue;
    const auto i = static_cast<std::size_t>(control.velocity);
    const double position = tree_.links()[static_cast<std::size_t>(control.link)].position;
    driven_[i * count_ + i] += control.resistance(duration);
    rates_[i] += control.pull(duration, position) - control.resistance(duration) * tree_.velocities()[i];
  }
  for (std::size_t i = 0; i < prescribed(); ++i) {
    const double change = base_[i] - tree_.velocities()[i];
    for (std::size_t j = prescribed(); j < count_; ++j) rates_[j] -= inertia_[j * count_ + i] * change;
  }
  factors_ = driven_;
  factor(factors_);
  accelerate(factors_, rates_);
  for (std::size_t i = 0; i < count_; ++i) kicked_[i] = tree_.velocities()[i] + rates_[i];
  std::copy_n(base_.begin(), prescribed(), kicked_.begin());
}

// Of the links, as the tree coasts, from those that it has at constant velocities.
void TreeDynamics::find_accelerations() {
  const std::vector<Articulation::Link>& links = tree_.links();
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (links[i].last_velocity < 0) continue;
    for (int j = links[i].last_velocity; j >= 0; j = tree_.above(j)) {
      accelerations_[i] += tree_.motions()[static_cast<std::size_t>(j)] * coasting_[static_cast<std::size_t>(j)];
    }
  }
}

void TreeDynamics::coast(double duration, std::vector<double>& velocities, std::vector<double>& way) {
  double fastest = 0.0, most = 0.0;
  for (std::size_t i = prescribed(); i < count_; ++i) {
    fastest = std::max(fastest, std::abs(velocities[i]));
    most = std::max(most, std::abs(duration * coasting_[i]));
  }
  const bool exact = !coupled_ && (!drives_ || (tree_.free() && !tree_.kinematic()));
  if (exact && (most > steady * fastest || !coasting_gravity_.isZero())) {
    return coast_by_runge_kutta(duration, velocities, way);
  }
  // Of what turns by radians in a substep, the change would be many times the velocities.
  const double within = most > fastest ? duration * fastest / most : duration;
  for (std::size_t i = 0; i < count_; ++i) {
    way[i] = velocities[i] + 0.5 * within * coasting_[i];
    velocities[i] += within * coasting_[i];
  }
}

// The classical one of the fourth order.
void TreeDynamics::coast_by_runge_kutta(double duration, std::vector<double>& velocities, std::vector<double>& way) {
  const std::vector<double> start = velocities;
  std::vector<double> off(count_, 0.0), whole(count_, 0.0), change(count_, 0.0);
  std::vector<double> rate_of_way(count_), acceleration(count_);
  const double shares[] = {0.5, 0.5, 1.0, 0.0};
  const double weights[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
  for (int stage = 0; stage < 4; ++stage) {
    rate(off, velocities, rate_of_way, acceleration);
    for (std::size_t i = 0; i < count_; ++i) {
      whole[i] += weights[stage] * rate_of_way[i];
      change[i] += weights[stage] * duration * acceleration[i];
      off[i] = shares[stage] * duration * rate_of_way[i];
      velocities[i] = start[i] + shares[stage] * duration * acceleration[i];
    }
  }
  tree_.put_back();
  find_inertia();
  for (std::size_t i = 0; i < count_; ++i) velocities[i] = start[i] + change[i];
  way = whole;
}

// Rates of the way and of the velocities, a way off. The turn of a base is a vector, whose rate is not the angular
// velocity (Munthe-Kaas 1998).
void TreeDynamics::rate(const std::vector<double>& way, const std::vector<double>& velocities,
                        std::vector<double>& way_rate, std::vector<double>& acceleration) {
  tree_.put_off(way);
  find_inertia();
  find_bias(velocities);
  Matrix factors = inertia_;
  factor(factors);
  for (std::size_t i = 0; i < count_; ++i) acceleration[i] = -bias_[i];
  if (!coasting_gravity_.isZero()) {
    find_forces(coasting_gravity_, false);
    for (std::size_t i = 0; i < count_; ++i) acceleration[i] += forces_[i];
  }
  accelerate(factors, acceleration);
  way_rate = velocities;
  if (!tree_.free()) return;
  const btVector3 turn = vector(way.data() + 3);
  const btVector3 spin = vector(velocities.data() + 3);
  const btVector3 once = turn.cross(spin);
  const btVector3 of_turn = spin - 0.5 * once + turn.cross(once) / 12.0;
  for (int axis = 0; axis < 3; ++axis) way_rate[static_cast<std::size_t>(3 + axis)] = of_turn[axis];
}

btVector3 TreeDynamics::bend(int link, const btVector3& point) const {
  const auto index = static_cast<std::size_t>(link);
  const SpatialVector& motion = motions_[index];
  const SpatialVector& acceleration = accelerations_[index];
  const btVector3 arm = point - tree_.origin();
  return acceleration.linear + acceleration.angular.cross(arm) +
         motion.angular.cross(motion.linear + motion.angular.cross(arm));
}

double TreeDynamics::work_on_base(double duration, const double* before, const double* after) const {
  double work = 0.0;
  for (std::size_t i = 0; i < prescribed(); ++i) {
    double impulse = duration * (bias_[i] - forces_[i]);
    for (std::size_t j = 0; j < count_; ++j) impulse += inertia_[i * count_ + j] * (after[j] - before[j]);
    work += 0.5 * (before[i] + after[i]) * impulse;
  }
  return work;
}

double TreeDynamics::gravity_beside(double duration, const std::vector<double>& before,
                                    const std::vector<double>& after) {
  if (coasting_gravity_.isZero()) return 0.0;
  const auto power = [&](const std::vector<double>& velocities) {
    find_forces(coasting_gravity_, false);
    double sum = 0.0;
    for (std::size_t i = 0; i < count_; ++i) sum += forces_[i] * velocities[i];
    return sum;
  };
  const double at_start = power(before);
  std::vector<double> way = tree_.ways();
  for (double& along : way) along *= duration;
  tree_.put_off(way);
  const double at_end = power(after);
  tree_.put_back();
  return 0.5 * duration * (at_end - at_start);
}

// Cholesky's factor of what is not prescribed, in the lower triangle, with the inverse of its diagonal.
void TreeDynamics::factor(Matrix& matrix) const {
  double* const m = matrix.data();
  for (std::size_t i = prescribed(); i < count_; ++i) {
    for (std::size_t j = prescribed(); j <= i; ++j) {
      double sum = m[i * count_ + j];
      for (std::size_t k = prescribed(); k < j; ++k) sum -= m[i * count_ + k] * m[j * count_ + k];
      m[i * count_ + j] = i == j ? 1.0 / std::sqrt(sum) : sum * m[j * count_ + j];
    }
  }
}

// Replaces impulses along the velocities by the changes that they make.
void TreeDynamics::accelerate(const Matrix& factors, std::vector<double>& rates) const {
  const double* const m = factors.data();
  for (std::size_t i = 0; i < prescribed(); ++i) rates[i] = 0.0;
  for (std::size_t i = prescribed(); i < count_; ++i) {
    double sum = rates[i];
    for (std::size_t k = prescribed(); k < i; ++k) sum -= m[i * count_ + k] * rates[k];
    rates[i] = sum * m[i * count_ + i];
  }
  for (std::size_t i = count_; i-- > prescribed();) {
    double sum = rates[i];
    for (std::size_t k = i + 1; k < count_; ++k) sum -= m[k * count_ + i] * rates[k];
    rates[i] = sum * m[i * count_ + i];
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
