#pragma once
// Impulses of a step of scenes with joints.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "physics/articulated/tree_dynamics.hpp"
#include "physics/articulated/velocity_rows.hpp"
#include "physics/impulse_work.hpp"
#include "physics/load.hpp"
#include "physics/stepper.hpp"

namespace energymargin {

//! A joint that follows another one, on the same tree or on two.
struct MimicConstraint {
  struct End {
    std::size_t tree;
    int link;
  };
  End follower, followed;
  Mimic mimic;
  double impulse = 0.0;  // of the last step
};

//! Solves contacts, drives, stops, mimics and motors together. Rigid bodies and trees are alike for it: each has some
//! of all velocities, and says how they respond to an impulse.
class ArticulatedSolver {
 public:
  //! Adds to the work of `audit`, which outlives this, while that is on. Bodies, trees and mimics do so too.
  ArticulatedSolver(const std::vector<btRigidBody*>& bodies, const std::vector<Articulation*>& trees,
                    std::vector<MimicConstraint>& mimics, ImpulseAudit& audit);

  //! Changes the velocities of bodies and trees, and by split impulses the places of bodies that overlap. Returns
  //! whether it converged.
  bool solve(const StepPart& part, const btVector3& gravity);

 private:
  struct Mover {
    VelocitySpan span;
    btRigidBody* body;  // or a tree
    std::size_t tree;
  };
  struct End {                     // of a contact
    const Mover* mover = nullptr;  // null: fixed
    int link = 0;
    btVector3 point{};
  };

  Mover& mover_of(std::size_t body) { return movers_[static_cast<std::size_t>(slots_[body])]; }
  Mover& mover_of_tree(std::size_t tree) { return movers_[movers_.size() - trees_.size() + tree]; }
  bool is_kinematic(const Mover& mover) const;
  void drive(const Motor& motor);
  void start(double duration);
  void add_motor(const Motor& motor, double duration);
  void add_controls(std::size_t tree, const btContactSolverInfo& info);
  void add_drive(const Mover& mover, JointControl& control, double position, const btContactSolverInfo& info);
  void add_stop(const Mover& mover, const JointControl& control, double direction, double gap, double& stored,
                const btContactSolverInfo& info);
  void add_mimic(MimicConstraint& mimic, const btContactSolverInfo& info);
  void add_contacts(btPersistentManifold& manifold, const btContactSolverInfo& info);
  void add_contact(btManifoldPoint& point, const End& a, const End& b, const btContactSolverInfo& info);
  VelocityRow contact_row(const End& a, const End& b, const btVector3& direction, double& stored);
  template <typename Jacobian>
  VelocityRow row(const Mover* a, const Mover* b, const Jacobian& jacobian);
  void respond(const Mover& mover, const double* jacobian, double* response) const;
  void add(const End& end, const btVector3& impulse, double* jacobian) const;
  bool update_limits(double duration);
  void write_back(const btContactSolverInfo& info);
  void add_work(const btContactSolverInfo& info);
  void add_work_on_kinematic(double duration, const std::vector<double>& before);

  std::vector<TreeDynamics> trees_;
  std::vector<MimicConstraint>& mimics_;
  ImpulseAudit& audit_;
  std::vector<Mover> movers_;  // rigid bodies, then trees
  std::vector<int> slots_;     // movers of bodies by their index in the scene; -1: fixed
  std::size_t velocities_ = 0;
  VelocityRows rows_;
};

}  // namespace energymargin
