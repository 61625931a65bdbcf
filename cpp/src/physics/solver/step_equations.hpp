#pragma once
// The equations of a substep: from bodies, contacts, joints and motors to velocities, and back.

#include <vector>

#include "physics/bodies/moving_bodies.hpp"
#include "physics/bodies/tree_dynamics.hpp"
#include "physics/contacts/contact_point.hpp"
#include "physics/motion.hpp"
#include "physics/solver/newton_solver.hpp"

namespace energymargin {

//! What a substep is solved with.
struct Substep {
  double duration;  // [s]
  double whole;     // of a step [s]
  std::vector<ContactPoint>& contacts;
  const std::vector<Motor>& motors;
  int iterations;
  double tolerance;
};

//! Sets up A (v - v_free) = sum of J' lambda(target - J v), and lets all coast from its solution: equation (2) of
//! docs/engineering/contact.md#the-equations-of-a-step. Each body or tree is a mover with some of all velocities v;
//! contacts, stops, limited drives, mimics and motors are rows of J.
class StepEquations {
 public:
  //! `bodies` and `audit` outlive this. Adds to the work of `audit` while that is on.
  StepEquations(const Scene& scene, MovingBodies& bodies, ImpulseAudit& audit);

  //! Finds the velocities at the end of the substep, and the bodies' ways. Whether the solver converged.
  bool solve(const Substep& substep);

  //! The bodies have these velocities from now on, and the contacts their impulses.
  void commit(const Substep& substep, double share);

  //! Velocities of a body on its own after the loads and impulses of the substep, before it coasted.
  const Velocity& pushed(std::size_t body) const { return rigid(body).pushed; }

 private:
  enum class Kind { motor, drive, stop, mimic };
  struct RigidMover {
    btRigidBody* body;
    int mover = -1;                          // of the solver; -1: kinematic
    std::vector<int> axes{};                 // that are not locked: 0..2 linear, 3..5 angular
    btVector3 turning = btVector3(0, 0, 0);  // angular acceleration as it coasts [rad/s^2]
    Velocity pushed{};                       // after loads and impulses
    btVector3 spin = btVector3(0, 0, 0);     // angular velocity at the end of the substep [rad/s]
  };
  struct Frame {
    btVector3 axes[3];  // two along the plane of contact, and the normal
  };
  struct End {
    std::size_t body;
    btVector3 point, grip;
    double sign;
  };

  void find_axes(const Scene& scene);
  void add_rigid(std::size_t i, double duration);
  void kick(std::size_t i, double duration, double* free) const;
  void find_turning(std::size_t i, double duration);
  void coast(std::size_t i, double duration, btVector3& mean);
  void add_tree(std::size_t i, const Substep& substep);
  LimitedRow& add_limited(Kind kind, int a, int b);
  void add_motor(const Motor& motor, double duration);
  void drive_kinematic(const Motor& motor);
  void add_stop(std::size_t tree, const JointControl& control, double direction, double gap, const Substep& substep);
  void add_drive(std::size_t tree, const JointControl& control, double position, double duration);
  void add_mimic(const MimicConstraint& mimic, const Substep& substep);
  bool add_contact(const ContactPoint& point, const Substep& substep);
  void add_end(ContactRows& rows, const End& end, const Frame& frame, double duration);
  void add_rigid_end(ContactRows& rows, const End& end, const Frame& frame, double duration);
  void add_tree_end(ContactRows& rows, const End& end, const Frame& frame, double duration);
  static btVector3 bend_of(const RigidMover& rigid, const btVector3& spin, const btVector3& arm, double duration);
  bool update_bends(const Substep& substep);
  btVector3 bend_change(const End& end, double duration) const;
  void share_error(double error, const Substep& substep, double& target, double& recovery) const;
  void write_contacts(std::vector<ContactPoint>& points) const;
  void set_rigid(std::size_t i, double duration);
  void set_tree(std::size_t i, double duration);
  bool is_alone(std::size_t tree, const Substep& substep) const;
  int mover_of(std::size_t body) const;
  bool is_rigid(std::size_t body) const { return rigid_of_[body] >= 0; }
  const RigidMover& rigid(std::size_t body) const { return rigids_[static_cast<std::size_t>(rigid_of_[body])]; }
  btVector3 mean_velocity(std::size_t body, const btVector3& point) const;
  btVector3 prescribed_velocity(std::size_t body, const btVector3& point) const;
  void add_work(const Substep& substep, double share);
  void add_contact_work(const ContactPoint& point);
  void add_limited_work();
  void add_recovery_work(double duration);

  MovingBodies& bodies_;
  ImpulseAudit& audit_;
  btVector3 gravity_;
  std::vector<RigidMover> rigids_;
  std::vector<int> rigid_of_;   // by the index in the scene; -1: in a tree, or fixed
  std::vector<double> masses_;  // of all bodies; 0: fixed
  std::vector<TreeDynamics> trees_;
  std::vector<int> tree_movers_;
  std::vector<std::vector<double>> tree_pushed_, tree_ends_;  // velocities before and after the trees coast
  NewtonSolver solver_;
  std::vector<Kind> kinds_;                  // of the solver's limited rows
  std::vector<std::size_t> contact_points_;  // of the solver's contacts
};

}  // namespace energymargin
