#pragma once
// The equations of a substep: from bodies, contacts, joints and motors to velocities, and back.

#include <optional>
#include <utility>
#include <vector>

#include "physics/bodies/moving_bodies.hpp"
#include "physics/native/newton_solver.hpp"

namespace energymargin {

//! When what bounces does so.
enum class Bounces {
  now,    ///< what touches; the substep takes no time, and has the contacts of the blow alone
  later,  ///< once it touches: it has no contacts before that
  never   ///< it stops
};

//! What a substep is solved with.
struct Substep {
  double duration;  // [s]
  std::vector<ContactPoint>& contacts;
  const std::vector<Motor>& motors;
  Bounces bounces;
};

//! Sets up A (v - v_free) = sum of J' lambda(target - J v), and lets all coast from its solution: equation (2) of
//! docs/engineering/contact.md#the-equations-of-a-step. Each body or tree is a mover with some of all velocities v;
//! contacts, stops, limited drives, mimics and motors are rows of J.
class StepEquations {
 public:
  //! Motors and stops are soft in the same sense as contacts.
  static constexpr double softness_share = 1e-5;

  //! This share of an error of the positions is put right in a whole step; Bullet's own value.
  static constexpr double error_share = 0.2;

  //! Joints that follow others, and loops, hold more tightly.
  static constexpr double coupling_softness = 1e-7;

  //! An impulse along a row has to move its bodies by more than this share of what it would do to them alone: two links
  //! of one tree may hardly move along it, and a row that hardly moves anything would ask for boundless speeds.
  static constexpr double least_inverse_mass = 1e-6;

  //! A substep is to turn what is in a loop by less than the first, and has not converged beyond the second [rad].
  static constexpr double loop_turn = 0.1, most_loop_turn = 0.3;

  //! Both outlive this.
  StepEquations(const Scene& scene, MovingBodies& bodies);

  //! Whether bodies that bounce touch and meet: then the next substep is their blow.
  bool find_blow(const std::vector<ContactPoint>& contacts);

  //! Finds the velocities at the end of the substep, and the bodies' ways. Whether the solver converged.
  bool solve(const Substep& substep);

  //! The bodies have these velocities from now on, and the contacts their impulses.
  void commit(const Substep& substep, double share);

  //! Gives loops of free bodies, and joints that follow others, velocities that keep them together, where they are
  //! after a substep [s].
  void join_velocities(double duration);

  //! Of `duration`, as long as what is in a loop turns by little, and not less than `least` [s].
  double until_turned(double duration, double least) const;

  //! Whether what is in a loop turns by too much in a substep for the loop to keep its energy.
  bool turns_too_far(double duration) const { return fastest_in_loops() * duration > most_loop_turn; }

  //! Velocities of a tree after the loads and impulses of the substep, before it coasted.
  const std::vector<double>& pushed(std::size_t tree) const { return trees_[tree].pushed; }

  //! Its work grows with each substep while it is on.
  ImpulseAudit audit{};

 private:
  struct TreeMover {
    int mover = -1;                   // of the solver; -1: nothing of the tree moves but by its kinematic base
    std::vector<double> pushed, end;  // velocities before and after the tree coasts
  };
  //! Two axes along the plane of contact, the normal, and those of rows that turn, as long as these count [m].
  using Frame = std::array<btVector3, most_rows>;
  struct End {
    std::size_t body;
    btVector3 point, grip;
    double sign;
  };

  struct LoopGap {
    btVector3 at_a, at_b;  // the frames' origins
    SpatialVector gap;
  };
  struct LoopRow {
    const LoopConstraint* loop;
    bool turns;
    btVector3 axis;
    std::size_t row;  // among the limited ones
    double wanted;    // gap along the axis at the end of the substep
    double weight;    // of what it is off by
    double moved;     // speed along it that is prescribed
  };

  struct BentRow {
    std::size_t row;  // among the limited ones
    double bend;      // of the way along it, as its target has it [m/s or rad/s]
  };

  void add_free(FreeBody& body, double duration);
  void damp(const FreeBody& body, double duration);
  void kick(const FreeBody& body, double duration, double* free) const;
  void release_locked(const std::vector<ContactPoint>& contacts);
  void release(std::size_t body, const btVector3& normal);
  void hold_released(const FreeBody& body);
  bool stays(std::size_t body, const btVector3& normal) const;
  bool bears(const ContactPoint& point) const;
  bool set_bearing(ContactRows& rows, double distance) const;
  static btVector3 locked_load(const FreeBody& body);
  void find_turning(FreeBody& body, double duration) const;
  void coast(FreeBody& body, double duration) const;
  void add_tree(std::size_t i, const Substep& substep);
  void add_motor(const Motor& motor, double duration);
  LimitedRow& add_joint_row(std::size_t tree, const JointControl& control, double direction);
  void set_stop(LimitedRow& row, double gap, double duration);
  void set_dry_friction(LimitedRow& row, double most, double duration);
  void follow_way(LimitedRow& row, double duration);
  template <typename Value>
  double along(const LimitedRow& row, const Value& value) const;
  bool straighten_ways(double duration);
  void set_drive(LimitedRow& row, const Control& control, double position, double duration);
  JointState sum_of(const JointSum& sum) const;
  LimitedRow& add_sum_row(const JointSum& sum, double direction);
  template <typename Visit>
  void for_each_velocity(const JointSum& sum, const Visit& visit) const;
  void join(const std::vector<MimicConstraint>& mimics);
  bool ties_free(const LoopConstraint& loop) const;
  void join_loops(double duration);
  double fastest_in_loops() const;
  void add_mimic(const MimicConstraint& mimic, double duration);
  void add_tendon(const TendonControl& tendon, double duration);
  static LoopGap gap_of(const LoopConstraint& loop, const btTransform& of_a, const btTransform& of_b);
  void add_loop(const LoopConstraint& loop, double duration);
  double inverse_mass_alone(const LoopConstraint& loop, bool turns) const;
  void add_loop_rows(const LoopConstraint& loop, const LoopGap& gap, bool turns, double duration);
  double add_loop_end(LimitedRow& row, std::size_t body, const btVector3& point, const SpatialVector& along);
  bool close_loops(double duration);
  bool solve_rows(const Substep& substep);
  bool stays_open(const ContactPoint& point, const Substep& substep);
  double normal_speed(const End& end, const btVector3& normal, double* row);
  bool add_contact(const ContactPoint& point, const Substep& substep);
  static Frame frame_of(const ContactPoint& point, const Surface& surface);
  bool set_normal(ContactRows& rows, const ContactPoint& point, const Surface& surface, const Substep& substep) const;
  void set_rebound(ContactRows& rows, const Surface& surface) const;
  double closing_speed(const ContactPoint& point) const;
  bool touches(const ContactPoint& point) const;
  std::optional<std::size_t> movable(std::size_t body) const;
  std::size_t root_of(std::size_t number);
  void find_touching(const std::vector<ContactPoint>& contacts);
  bool bounce(std::size_t a, std::size_t b) const;
  void find_gains(double time, double duration, std::vector<double>& gains) const;
  void find_lags(double duration);
  bool find_drifts(double duration);
  void add_drifts();
  void add_drift_work(double duration);
  bool weaken_bounces(bool converged);
  bool weaken_gains();
  bool gains(const Island& island) const;
  void add_end(ContactRows& rows, const End& end, const Frame& frame, double duration);
  void add_free_end(ContactRows& rows, const End& end, const Frame& frame, double duration);
  void add_tree_end(ContactRows& rows, const End& end, const Frame& frame, double duration);
  static btVector3 bend_of(const FreeBody& body, const btVector3& spin, const btVector3& arm, double duration);
  bool update_bends(const Substep& substep);
  btVector3 bend_change(const End& end, double duration) const;
  void share_error(double error, double& target, double& recovery) const;
  void write_contacts(std::vector<ContactPoint>& points) const;
  void set_all(double duration);
  void add_recovery(double duration);
  void set_free(FreeBody& body, double duration) const;
  void set_tree(std::size_t i, double duration);
  bool is_alone(std::size_t tree, const Substep& substep) const;
  bool is_free(std::size_t tree, const Substep& substep) const;
  int mover_of(std::size_t body) const;
  Articulation& tree(std::size_t index) const { return *bodies_.trees()[index]; }
  btVector3 mean_velocity(std::size_t body, const btVector3& point) const;
  btVector3 prescribed_velocity(std::size_t body, const btVector3& point) const;
  btVector3 surface_velocity(std::size_t body) const;
  void add_work(const Substep& substep, double share);
  void add_contact_work(const ContactPoint& point);
  void add_surface_work(const ContactPoint& point);
  void add_limited_work();
  void add_recovery_work(double duration);
  void add_damping_work(double duration);

  const Scene& scene_;
  std::vector<double> gives_;  // of each body: by how much its contacts may give way under a load [m/s]
  bool surfaces_;              // whether a body has one, or a pair of bodies its coefficients
  bool locks_;                 // whether a free body has a locked axis
  MovingBodies& bodies_;
  std::vector<TreeMover> trees_;
  NewtonSolver solver_;
  std::vector<std::size_t> contact_points_;  // of the solver's contacts
  std::vector<LoopRow> loop_rows_;
  std::vector<BentRow> bent_rows_;
  std::vector<bool> in_blow_;          // of the contacts: whether they take part in the next blow
  std::vector<std::size_t> roots_;     // of what moves: one of those that touch it, directly or by others
  std::vector<double> fastest_;        // at which those of a root meet that bounce [m/s]
  std::vector<double> lags_, drifts_;  // of all velocities: by which they lag, and by which bodies go on beside them
  std::vector<double> whole_;          // scratch: a row over all velocities of a tree
  std::vector<double> row_;            // scratch: a normal row over those of two movers
  std::vector<std::pair<int, int>> closing_;  // movers whose contacts all have rows
};

//! Calls `visit(tree, velocity, coefficient)` for each joint of a sum that moves.
template <typename Visit>
void StepEquations::for_each_velocity(const JointSum& sum, const Visit& visit) const {
  for (const auto& [on, coefficient] : sum.terms) {
    const int velocity = tree(on.tree).link(on.link).velocity;
    if (velocity >= 0) visit(on.tree, static_cast<std::size_t>(velocity), coefficient);
  }
}

}  // namespace energymargin
