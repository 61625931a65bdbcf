// The equations of motion of a tree.

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/portable.hpp"
#include "physics/bodies/articulation.hpp"

namespace energymargin {
namespace {

// Where velocities change by less than this share of themselves as the tree coasts, their mean is as good as any.
constexpr double steady = 1e-5;
// rad: a link turns by no more in a Runge-Kutta step, but for the fastest ones, which are not to take forever.
constexpr double short_turn = 0.05;
constexpr double most_pieces = 16;

// (1 - x cot(x)) / (4 x^2) for x = angle / 2, and its limit, by the square of an angle.
double second_order_of_turn(double square) {
  if (square < 0.01) return 1.0 / 12.0;
  const double half = 0.5 * std::sqrt(square);
  return (1.0 - half / portable::tan(half)) / square;
}

}  // namespace

void Articulation::prepare(double duration, const btVector3& gravity, bool alone) {
  find_inertia();
  find_forces(alone ? btVector3(0, 0, 0) : gravity, true);
  coasting_gravity_ = alone ? gravity : btVector3(0, 0, 0);
  kick(duration);
  find_bias(velocities_);
  for (std::size_t i = 0; i < count(); ++i) coasting_[i] = -bias_[i];
  if (alone) {
    find_forces(gravity, false);
    for (std::size_t i = 0; i < count(); ++i) coasting_[i] += forces_[i];
  }
  accelerate(factors_, coasting_);
  if (looped_) {
    for (std::size_t i = 0; i < count(); ++i) kicked_[i] += duration * coasting_[i];
    std::fill(coasting_.begin(), coasting_.end(), 0.0);
  }
  find_accelerations();
}

void Articulation::find_inertia() {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Link& link = links_[i];
    if (link.last_velocity < 0) continue;
    bodies_[i] = SpatialInertia(link.mass, link.moments, link.pose.getBasis(), link.pose.getOrigin() - origin());
    composites_[i] = bodies_[i];
  }
  for (std::size_t i = links_.size() - 1; i > 0; --i) {
    const auto parent = static_cast<std::size_t>(links_[i].parent);
    if (links_[parent].last_velocity >= 0) composites_[parent] += composites_[i];
  }
  for (std::size_t i = 0; i < count(); ++i) {
    const SpatialVector momentum = composites_[movers_[i]] * motions_[i];
    for (int j = static_cast<int>(i); j >= 0; j = above(j)) {
      const auto other = static_cast<std::size_t>(j);
      inertia_[i * count() + other] = inertia_[other * count() + i] = motions_[other].dot(momentum);
    }
    inertia_[i * count() + i] += links_[movers_[i]].armature;
  }
}

// Finds the forces of gravity, and maybe of loads, along the velocities.
void Articulation::find_forces(const btVector3& gravity, bool loads) {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    btVector3 force = gravity * links_[i].mass;
    if (loads) force += links_[i].force;
    const btVector3 arm = links_[i].pose.getOrigin() - origin();
    link_forces_[i] = {arm.cross(force), force};
    if (loads) link_forces_[i].angular += links_[i].torque;
  }
  for (std::size_t i = links_.size() - 1; i > 0; --i) {
    link_forces_[static_cast<std::size_t>(links_[i].parent)] += link_forces_[i];
  }
  for (std::size_t i = 0; i < count(); ++i) forces_[i] = motions_[i].dot(link_forces_[movers_[i]]);
}

// The force on each link, and all that hangs on it, that keeps its velocities constant. A free base moves in a straight
// line then: what is at the common point is another point of it in each moment, which makes an acceleration.
void Articulation::find_bias(const std::vector<double>& velocities) {
  const std::vector<SpatialVector>& motions = coasting_motions_ = link_motions(velocities);
  accelerations_[0] = {btVector3(0, 0, 0), motions[0].linear.cross(motions[0].angular)};
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Link& link = links_[i];
    if (link.last_velocity < 0) {
      accelerations_[i] = {};
      continue;
    }
    if (link.joint) accelerations_[i] = accelerations_[static_cast<std::size_t>(link.parent)];
    if (link.joint && link.velocity >= 0) {
      const auto velocity = static_cast<std::size_t>(link.velocity);
      accelerations_[i] += motions[i].cross_motion(motions_[velocity] * velocities[velocity]);
    }
    link_forces_[i] = bodies_[i] * accelerations_[i] + motions[i].cross_force(bodies_[i] * motions[i]);
  }
  for (std::size_t i = links_.size() - 1; i > 0; --i) {
    const auto parent = static_cast<std::size_t>(links_[i].parent);
    if (links_[parent].last_velocity >= 0) link_forces_[parent] += link_forces_[i];
  }
  for (std::size_t i = 0; i < count(); ++i) bias_[i] = motions_[i].dot(link_forces_[movers_[i]]);
}

// A kinematic base has no rates of its own; what it changes by, the joints feel.
void Articulation::kick(double duration) {
  driven_ = inertia_;
  for (std::size_t i = 0; i < count(); ++i) rates_[i] = duration * forces_[i];
  for (const JointControl& control : controls_) {
    if (!control.law->drives() || drives_by_row(control)) continue;
    const auto i = static_cast<std::size_t>(control.velocity);
    const double position = links_[static_cast<std::size_t>(control.link)].position;
    driven_[i * count() + i] += control.resistance(duration);
    rates_[i] += control.pull(duration, position) - control.resistance(duration) * velocities_[i];
  }
  for (int axis = 0; free_ && !kinematic() && axis < velocities_of_free_body; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const double resistance = duration * scene_.bodies()[links_.front().body].damping(axis);
    driven_[i * count() + i] += resistance;
    rates_[i] -= resistance * velocities_[i];
  }
  for (std::size_t i = 0; i < prescribed(); ++i) {
    const double change = base_[i] - velocities_[i];
    for (std::size_t j = prescribed(); j < count(); ++j) rates_[j] -= inertia_[j * count() + i] * change;
  }
  factors_ = driven_;
  factor(factors_);
  accelerate(factors_, rates_);
  for (std::size_t i = 0; i < count(); ++i) kicked_[i] = velocities_[i] + rates_[i];
  std::copy_n(base_.begin(), prescribed(), kicked_.begin());
}

// Turns the accelerations of the links at constant velocities into those as the tree coasts.
void Articulation::find_accelerations() {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    if (links_[i].last_velocity < 0) continue;
    for (int j = links_[i].last_velocity; j >= 0; j = above(j)) {
      accelerations_[i] += motions_[static_cast<std::size_t>(j)] * coasting_[static_cast<std::size_t>(j)];
    }
  }
}

void Articulation::coast(double duration, std::vector<double>& velocities) {
  if (looped_) return coast_in_loop(duration, velocities);
  double fastest = 0.0, most = 0.0;
  for (std::size_t i = 0; i < count(); ++i) {
    fastest = std::max(fastest, std::abs(velocities[i]));
    most = std::max(most, std::abs(duration * coasting_[i]));
  }
  const bool exact = !drives_ || (free_ && !kinematic());
  if (exact && (most > steady * fastest || !coasting_gravity_.isZero())) {
    return coast_by_runge_kutta(duration, velocities);
  }
  // Of what turns by radians in a substep, the change would be many times the velocities.
  const double within = most > fastest ? duration * fastest / most : duration;
  for (std::size_t i = 0; i < count(); ++i) {
    ways_[i] = velocities[i] + 0.5 * within * coasting_[i];
    velocities[i] += within * coasting_[i];
  }
}

// A tree that is in a loop does not leave it: it goes straight on at its velocities, which have the bias of the start
// in them. A free base then makes up for what bends, so that the tree's centre of mass and its momenta go as they must.
void Articulation::coast_in_loop(double duration, std::vector<double>& velocities) {
  ways_ = velocities;
  if (!free_ || kinematic()) return;
  Momenta wanted = momenta(velocities);
  const btVector3 linear = duration * vector(bias_.data()), angular = duration * vector(bias_.data() + 3);
  wanted.linear += linear;
  wanted.angular += angular - (center_of_mass() - origin()).cross(linear);
  const btVector3 center = center_of_mass();
  look_ahead(duration);
  find_inertia();
  set_momenta(wanted, velocities);
  const btVector3 off = wanted.linear / inertia_[0] - (center_of_mass() - center) / duration;
  for (std::size_t axis = 0; axis < 3; ++axis) ways_[axis] += off[static_cast<int>(axis)];
  put_back();
  find_inertia();
}

void Articulation::add_to_ways(const double* more, double duration, std::vector<double>& velocities) {
  const bool keeps = free_ && !kinematic() && std::any_of(more, more + count(), [](double way) { return way != 0.0; });
  Momenta before;
  if (keeps) {
    look_ahead(duration);
    find_inertia();
    before = momenta(velocities);
    put_back();
  }
  for (std::size_t k = prescribed(); k < count(); ++k) ways_[k] += more[k - prescribed()];
  if (!keeps) return;
  look_ahead(duration);
  find_inertia();
  set_momenta(before, velocities);
  put_back();
}

// Where the inertia was found last.
Articulation::Momenta Articulation::momenta(const std::vector<double>& velocities) const {
  double sums[velocities_of_free_body] = {};
  for (std::size_t i = 0; i < velocities_of_free_body; ++i) {
    for (std::size_t k = 0; k < count(); ++k) sums[i] += inertia_[i * count() + k] * velocities[k];
  }
  const btVector3 linear = vector(sums);
  return {linear, vector(sums + 3) - (center_of_mass() - origin()).cross(linear)};
}

// By the velocities of a free base, where the inertia was found last.
void Articulation::set_momenta(const Momenta& wanted, std::vector<double>& velocities) const {
  const Momenta now = momenta(velocities);
  const btVector3 linear = wanted.linear - now.linear;
  const btVector3 angular = wanted.angular - now.angular + (center_of_mass() - origin()).cross(linear);
  Eigen::Matrix<double, velocities_of_free_body, velocities_of_free_body> whole;
  for (int i = 0; i < velocities_of_free_body; ++i) {
    for (int k = 0; k < velocities_of_free_body; ++k) {
      whole(i, k) = inertia_[static_cast<std::size_t>(i) * count() + static_cast<std::size_t>(k)];
    }
  }
  Eigen::Matrix<double, velocities_of_free_body, 1> missing;
  missing << from_bullet(linear), from_bullet(angular);
  Eigen::Map<Eigen::Matrix<double, velocities_of_free_body, 1>>(velocities.data()) += whole.ldlt().solve(missing);
}

btVector3 Articulation::center_of_mass() const {
  btVector3 sum(0, 0, 0);
  double mass = 0.0;
  for (const Link& link : links_) {
    sum += link.mass * link.pose.getOrigin();
    mass += link.mass;
  }
  return sum / mass;
}

// Takes classical steps of the fourth order, as many as the fastest link asks for.
void Articulation::coast_by_runge_kutta(double duration, std::vector<double>& velocities) {
  const double pieces = std::clamp(std::ceil(fastest_turn(velocities) * duration / short_turn), 1.0, most_pieces);
  std::vector<double> way(count(), 0.0), mean_rates(count(), 0.0);
  for (int piece = 0; piece < static_cast<int>(pieces); ++piece) {
    const std::vector<double> rates = runge_kutta_step(duration / pieces, way, velocities);
    for (std::size_t i = 0; i < count(); ++i) {
      way[i] += duration / pieces * rates[i];
      mean_rates[i] += rates[i] / pieces;
    }
  }
  put_back();
  find_inertia();
  ways_ = mean_rates;
}

// One such step from a way off, which changes the velocities; the mean rates of the way in it.
std::vector<double> Articulation::runge_kutta_step(double duration, const std::vector<double>& way,
                                                   std::vector<double>& velocities) {
  const std::vector<double> start = velocities;
  std::vector<double> off = way, mean(count(), 0.0), change(count(), 0.0);
  std::vector<double> rate_of_way(count()), acceleration(count());
  const double shares[] = {0.5, 0.5, 1.0, 0.0};
  const double weights[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
  for (int stage = 0; stage < 4; ++stage) {
    rate(off, velocities, rate_of_way, acceleration);
    for (std::size_t i = 0; i < count(); ++i) {
      mean[i] += weights[stage] * rate_of_way[i];
      change[i] += weights[stage] * duration * acceleration[i];
      off[i] = way[i] + shares[stage] * duration * rate_of_way[i];
      velocities[i] = start[i] + shares[stage] * duration * acceleration[i];
    }
  }
  for (std::size_t i = 0; i < count(); ++i) velocities[i] = start[i] + change[i];
  return mean;
}

// Rates of the way and of the velocities, a way off. The rate of a base's turn is not its spin (Munthe-Kaas 1998).
void Articulation::rate(const std::vector<double>& way, const std::vector<double>& velocities,
                        std::vector<double>& way_rate, std::vector<double>& acceleration) {
  put_off(way);
  find_inertia();
  find_bias(velocities);
  Matrix factors = inertia_;
  factor(factors);
  for (std::size_t i = 0; i < count(); ++i) acceleration[i] = -bias_[i];
  if (!coasting_gravity_.isZero()) {
    find_forces(coasting_gravity_, false);
    for (std::size_t i = 0; i < count(); ++i) acceleration[i] += forces_[i];
  }
  accelerate(factors, acceleration);
  way_rate = velocities;
  if (!free_) return;
  const btVector3 turn = vector(way.data() + 3);
  const btVector3 spin = vector(velocities.data() + 3);
  const btVector3 once = turn.cross(spin);
  const btVector3 of_turn = spin - 0.5 * once + turn.cross(once) * second_order_of_turn(turn.length2());
  for (int axis = 0; axis < 3; ++axis) way_rate[static_cast<std::size_t>(3 + axis)] = of_turn[axis];
}

btVector3 Articulation::bend(int link, const btVector3& point) const {
  const auto index = static_cast<std::size_t>(link);
  const SpatialVector& motion = coasting_motions_[index];
  const SpatialVector& acceleration = accelerations_[index];
  const btVector3 arm = point - origin();
  return acceleration.linear + acceleration.angular.cross(arm) +
         motion.angular.cross(motion.linear + motion.angular.cross(arm));
}

double Articulation::work_on_base(double duration, const std::vector<double>& before) const {
  double work = 0.0;
  for (std::size_t i = 0; i < prescribed(); ++i) {
    double impulse = duration * (bias_[i] - forces_[i]);
    for (std::size_t j = 0; j < count(); ++j) impulse += inertia_[i * count() + j] * (velocities_[j] - before[j]);
    work += 0.5 * (before[i] + velocities_[i]) * impulse;
  }
  return work;
}

double Articulation::gravity_beside(double duration, const std::vector<double>& before,
                                    const std::vector<double>& after) {
  if (coasting_gravity_.isZero()) return 0.0;
  const auto power = [&](const std::vector<double>& velocities) {
    find_forces(coasting_gravity_, false);
    double sum = 0.0;
    for (std::size_t i = 0; i < count(); ++i) sum += forces_[i] * velocities[i];
    return sum;
  };
  const double at_start = power(before);
  look_ahead(duration);
  const double at_end = power(after);
  put_back();
  return 0.5 * duration * (at_end - at_start);
}

// Puts Cholesky's factor of what is not prescribed, into the lower triangle, with the inverse of its diagonal.
void Articulation::factor(Matrix& matrix) const {
  double* const m = matrix.data();
  for (std::size_t i = prescribed(); i < count(); ++i) {
    for (std::size_t j = prescribed(); j <= i; ++j) {
      double sum = m[i * count() + j];
      for (std::size_t k = prescribed(); k < j; ++k) sum -= m[i * count() + k] * m[j * count() + k];
      m[i * count() + j] = i == j ? 1.0 / std::sqrt(sum) : sum * m[j * count() + j];
    }
  }
}

// Replaces impulses along the velocities by the changes that they make.
void Articulation::accelerate(const Matrix& factors, std::vector<double>& rates) const {
  const double* const m = factors.data();
  for (std::size_t i = 0; i < prescribed(); ++i) rates[i] = 0.0;
  for (std::size_t i = prescribed(); i < count(); ++i) {
    double sum = rates[i];
    for (std::size_t k = prescribed(); k < i; ++k) sum -= m[i * count() + k] * rates[k];
    rates[i] = sum * m[i * count() + i];
  }
  for (std::size_t i = count(); i-- > prescribed();) {
    double sum = rates[i];
    for (std::size_t k = i + 1; k < count(); ++k) sum -= m[k * count() + i] * rates[k];
    rates[i] = sum * m[i * count() + i];
  }
}

void Articulation::find_response() {
  find_inertia();
  factors_ = inertia_;
  factor(factors_);
}

void Articulation::add(int link, const SpatialVector& at_origin, double* impulses) const {
  for (int i = links_[static_cast<std::size_t>(link)].last_velocity; i >= 0; i = above(i)) {
    impulses[i] += motions_[static_cast<std::size_t>(i)].dot(at_origin);
  }
}

}  // namespace energymargin
