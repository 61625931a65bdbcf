// Contacts and motors as rows over the velocities, and back; the work of impulses.

#include <algorithm>

#include "physics/native/step_equations.hpp"

namespace energymargin {
namespace {

// What sticks uses less than this share of its friction. Bends that change by less are no solution worth [m/s].
constexpr double sticking_share = 0.999;
constexpr double least_bend = 1e-6;

// What turns by more than this in a substep bends its way by more than the first term says, and sticks nowhere
// for long: there a bend would do work [rad].
constexpr double most_bent = 0.1;

// Where a contact twists or rolls more easily than it slides, its friction is as much harder, but not more than this.
constexpr double least_turning = 1e-4;

}  // namespace

// False where an impulse along the normal moves nothing, and before bodies bounce.
bool StepEquations::add_contact(const ContactPoint& point, const Substep& substep) {
  const Surface surface = surfaces_ ? scene_.contact_surface(point.a, point.b) : Surface{};
  const Frame frame = frame_of(point, surface);
  const bool rubs = point.friction > 0.0, rolls = rubs && surface.rolling_friction > 0.0;
  const bool twists = rubs && (surface.torsional_friction > 0.0 || point.lever > 0.0);
  const int count = rolls ? most_rows : twists ? usual_rows + 1 : usual_rows;
  ContactRows& rows = solver_.add_contact(mover_of(point.a), mover_of(point.b), count);
  add_end(rows, {point.a, point.on_a, point.grip, 1.0}, frame, substep.duration);
  add_end(rows, {point.b, point.on_b, point.grip, -1.0}, frame, substep.duration);
  rows.law.friction = point.friction;
  rows.gives = std::min(gives_[point.a], gives_[point.b]);
  const double inverse_mass = solver_.inverse_mass(rows, 2);
  rows.law.normal_softness = FrictionLaw::normal_share * inverse_mass;
  if (!(inverse_mass * std::max(scene_.bodies()[point.a].mass, scene_.bodies()[point.b].mass) > least_inverse_mass) ||
      !(bears(point) ? set_bearing(rows, point.distance) : set_normal(rows, point, surface, substep))) {
    solver_.drop_contact();
    return false;
  }
  rows.law.tangential_softness =
      0.5 * FrictionLaw::tangential_share * (solver_.inverse_mass(rows, 0) + solver_.inverse_mass(rows, 1));
  // What cannot move along the contact's plane has no friction; what hardly resists a turn would creep first.
  if (!(rows.law.tangential_softness > 0.0)) rows.law.friction = 0.0;
  double share = 1.0;
  for (int i = usual_rows; i < rows.law.rows && rows.law.friction > 0.0; ++i) {
    const double turning = FrictionLaw::tangential_share * solver_.inverse_mass(rows, i);
    if (turning > 0.0) share = std::min(share, turning / rows.law.tangential_softness);
  }
  rows.law.tangential_softness *= std::max(share, least_turning);
  return true;
}

void StepEquations::add_end(ContactRows& rows, const End& end, const Frame& frame, double duration) {
  if (surfaces_) {
    const btVector3 velocity = surface_velocity(end.body) * end.sign;
    for (std::size_t i = 0; i < normal_row; ++i) rows.target[i] -= frame[i].dot(velocity);
  }
  if (bodies_.link(end.body)) return add_tree_end(rows, end, frame, duration);
  if (bodies_.free(end.body)) add_free_end(rows, end, frame, duration);
}

// The velocity of a point that a kinematic body has goes to the target; so does what the way of a free one bends by.
void StepEquations::add_free_end(ContactRows& rows, const End& end, const Frame& frame, double duration) {
  const FreeBody& body = *bodies_.free(end.body);
  const auto& [linear, spin] = body.velocity;
  const btVector3& center = bodies_.poses()[end.body].getOrigin();
  const btVector3 arm = end.point - center;
  const btVector3 grip = end.grip - center;
  const btVector3 bend = bend_of(body, spin, grip, duration);
  if (body.mover < 0) {
    const btVector3 at_point = linear + spin.cross(arm);
    const btVector3 at_grip = linear + spin.cross(grip) + bend;
    for (std::size_t i = 0; i < 3; ++i) rows.target[i] -= end.sign * frame[i].dot(i < 2 ? at_grip : at_point);
    for (int i = usual_rows; i < rows.law.rows; ++i) {
      rows.target[static_cast<std::size_t>(i)] -= end.sign * frame[i].dot(spin);
    }
    return;
  }
  const auto count = body.axes.size();
  double* const jacobian = solver_.numbers(rows.a == body.mover ? rows.of_a : rows.of_b);
  for (std::size_t i = 0; i < 3; ++i) {
    const btVector3 along = frame[i] * end.sign;
    const btVector3 about = (i < 2 ? grip : arm).cross(along);
    double* const row = jacobian + i * count;
    if (body.unlocked == 6) {
      for (int axis = 0; axis < 3; ++axis) {
        row[axis] = along[axis];
        row[3 + axis] = about[axis];
      }
    } else {
      for (std::size_t column = 0; column < count; ++column) {
        const int axis = body.axes[column];
        row[column] = axis < 3 ? along[axis] : about[axis - 3];
      }
    }
    if (i < 2) rows.target[i] -= along.dot(bend);
  }
  for (int i = usual_rows; i < rows.law.rows; ++i) {
    for (std::size_t column = 0; column < count; ++column) {
      const int axis = body.axes[column];
      if (axis >= 3) jacobian[static_cast<std::size_t>(i) * count + column] = end.sign * frame[i][axis - 3];
    }
  }
}

// How far the way of a point is off a straight one, over the time [m/s].
btVector3 StepEquations::bend_of(const FreeBody& body, const btVector3& spin, const btVector3& arm, double duration) {
  if (spin.length2() * duration * duration > most_bent * most_bent) return {0, 0, 0};
  return (spin.cross(spin.cross(arm)) + body.turning.cross(arm)) * (0.5 * duration);
}

// Ways bend by the spins at the end of the substep, which were not known. That counts where something sticks, and would
// creep. Whether it counts anywhere.
bool StepEquations::update_bends(const Substep& substep) {
  bool counts = false;
  for (std::size_t k = 0; k < contact_points_.size(); ++k) {
    ContactRows& rows = solver_.contacts()[k];
    double friction = rows.impulse[0] * rows.impulse[0] + rows.impulse[1] * rows.impulse[1];
    for (std::size_t i = usual_rows; i < most_rows; ++i) friction += rows.impulse[i] * rows.impulse[i];
    const double most = sticking_share * rows.law.friction * rows.impulse[2];
    if (!(friction < most * most)) continue;
    const ContactPoint& point = substep.contacts[contact_points_[k]];
    const btVector3 change = bend_change({point.a, point.on_a, point.grip, 1.0}, substep.duration) +
                             bend_change({point.b, point.on_b, point.grip, -1.0}, substep.duration);
    if (!(change.length2() > least_bend * least_bend)) continue;
    btVector3 x, y;
    btPlaneSpace1(point.normal, x, y);
    rows.target[0] -= x.dot(change);
    rows.target[1] -= y.dot(change);
    counts = true;
  }
  return counts;
}

btVector3 StepEquations::bend_change(const End& end, double duration) const {
  const FreeBody* body = bodies_.free(end.body);
  if (!body || body->mover < 0) return {0, 0, 0};
  Velocity after;
  for (std::size_t row = 0; row < body->axes.size(); ++row) {
    after[body->axes[row]] = solver_.velocities(body->mover)[row];
  }
  const btVector3 arm = end.grip - bodies_.poses()[end.body].getOrigin();
  return end.sign *
         (bend_of(*body, after.angular, arm, duration) - bend_of(*body, body->velocity.angular, arm, duration));
}

void StepEquations::add_tree_end(ContactRows& rows, const End& end, const Frame& frame, double duration) {
  const auto [index, link] = *bodies_.link(end.body);
  const Articulation& tree = this->tree(index);
  const std::size_t skipped = tree.prescribed();
  const std::size_t count = tree.count() - skipped;
  const int mover = trees_[index].mover;
  btVector3 bend = tree.bend(link, end.grip) * (0.5 * duration);
  if (tree.spin(link) * duration > most_bent) bend.setZero();
  whole_.resize(tree.count());
  for (std::size_t i = 0; i < static_cast<std::size_t>(rows.law.rows); ++i) {
    const btVector3 along = frame[i] * end.sign;
    std::fill(whole_.begin(), whole_.end(), 0.0);
    if (i < usual_rows) {
      tree.add(link, i < 2 ? end.grip : end.point, along, whole_.data());
    } else {
      tree.add(link, {along, {0, 0, 0}}, whole_.data());
    }
    for (std::size_t k = 0; k < skipped; ++k) rows.target[i] -= whole_[k] * tree.kicked()[k];
    if (i < 2) rows.target[i] -= along.dot(bend);
    if (mover < 0) continue;
    double* const row = solver_.numbers(rows.a == mover ? rows.of_a : rows.of_b) + i * count;
    for (std::size_t k = 0; k < count; ++k) row[k] += whole_[skipped + k];
  }
}

void StepEquations::write_contacts(std::vector<ContactPoint>& points) const {
  for (std::size_t k = 0; k < contact_points_.size(); ++k) {
    const ContactRows& rows = solver_.contacts()[k];
    ContactPoint& point = points[contact_points_[k]];
    btVector3 x, y;
    btPlaneSpace1(point.normal, x, y);
    point.normal_impulse = rows.impulse[2];
    point.friction_impulse = x * rows.impulse[0] + y * rows.impulse[1];
    if (rows.law.rows == usual_rows) continue;
    const Frame frame = frame_of(point, scene_.contact_surface(point.a, point.b));
    for (std::size_t i = usual_rows; i < most_rows; ++i) point.friction_twist += frame[i] * rows.impulse[i];
  }
}

// A row along and about each axis that is not locked.
void StepEquations::add_motor(const Motor& motor, double duration) {
  const int mover = mover_of(motor.body);
  const auto& link = bodies_.link(motor.body);
  if (mover < 0 || (link && tree(link->tree).prescribed() > 0)) return;
  const int count = link ? velocities_of_free_body : static_cast<int>(bodies_.free(motor.body)->unlocked);
  for (int column = 0; column < count; ++column) {
    const int axis = link ? column : bodies_.free(motor.body)->axes[static_cast<std::size_t>(column)];
    LimitedRow& row = solver_.add_limited(mover, -1);
    row.work = &audit.work.plan;
    solver_.numbers(row.of_a)[column] = 1.0;
    row.softness = softness_share * solver_.inverse_mass(row, 0);
    row.target = motor.velocity[axis];
    row.high = (axis < 3 ? motor.force : motor.torque) * duration;
    row.low = -row.high;
    if (link) follow_way(row, duration);
  }
}

void StepEquations::add_work(const Substep& substep, double share) {
  for (const std::size_t k : contact_points_) add_contact_work(substep.contacts[k]);
  add_limited_work();
  add_recovery_work(substep.duration * share);
  add_damping_work(substep.duration);
  if (substep.bounces != Bounces::now) add_drift_work(substep.duration * share);
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
  if (surfaces_) add_surface_work(point);
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
  for (const LoopRow& of : loop_rows_) {  // a kinematic end does the work of its drive
    const double work = solver_.limited()[of.row].impulse * of.moved;
    audit.work.joints += work;
    audit.work.plan -= work;
  }
}

void StepEquations::add_damping_work(double duration) {
  const auto add = [&](std::size_t body, const Velocity& before, const Velocity& after) {
    for (int axis = 0; axis < velocities_of_free_body; ++axis) {
      const double resistance = duration * scene_.bodies()[body].damping(axis);
      audit.work.damping -= resistance * after[axis] * 0.5 * (before[axis] + after[axis]);
    }
  };
  for (const FreeBody& body : bodies_.free()) {
    if (!body.kinematic) add(body.body, audit.before->bodies[body.body].velocity, body.velocity);
  }
  const auto of_base = [](const std::vector<double>& of) { return Velocity{vector(of.data()), vector(of.data() + 3)}; };
  for (std::size_t k = 0; k < trees_.size(); ++k) {
    if (!tree(k).free() || tree(k).kinematic()) continue;
    add(tree(k).link(0).body, of_base(audit.before->trees[k]), of_base(tree(k).velocities()));
  }
}

// Loads work on what bodies go on by beside their velocities, too.
void StepEquations::add_drift_work(double duration) {
  if (drifts_.empty()) return;
  for (const FreeBody& body : bodies_.free()) {
    if (body.mover < 0) continue;
    const double* const drift = drifts_.data() + solver_.begin(body.mover);
    for (std::size_t k = 0; k < body.axes.size() && body.axes[k] < 3; ++k) {
      audit.work.integration -= audit.before->bodies[body.body].force[body.axes[k]] * drift[k] * duration;
    }
  }
}

// Recovery moves bodies and leaves their velocities alone.
void StepEquations::add_recovery_work(double duration) {
  double work = 0.0;
  for (const FreeBody& body : bodies_.free()) {
    const Motion::OfBody& loaded = audit.before->bodies[body.body];
    for (std::size_t row = 0; row < body.unlocked; ++row) {
      const int axis = body.axes[row];
      const double load = axis < 3 ? loaded.force[axis] : loaded.torque[axis - 3];
      work += load * solver_.recovery(body.mover)[row];
    }
  }
  for (std::size_t i = 0; i < trees_.size(); ++i) {
    if (trees_[i].mover < 0) continue;
    const std::size_t skipped = tree(i).prescribed();
    const std::vector<double> loads = tree(i).loads(to_bullet(scene_.gravity()));
    for (std::size_t k = skipped; k < loads.size(); ++k) {
      work += loads[k] * solver_.recovery(trees_[i].mover)[k - skipped];
    }
  }
  audit.work.overlap -= work * duration;
}

}  // namespace energymargin
