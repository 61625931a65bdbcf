#pragma once
// Impulses of a step at the contacts of free and fixed bodies.

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "physics/free_bodies/contact_rows.hpp"
#include "physics/impulse_work.hpp"
#include "physics/load.hpp"

namespace energymargin {

//! Does for free bodies what Bullet's solver does; kinematic ones have the velocities of their motors, or keep theirs.
//! It knows no joints: a scene that has some is solved by ArticulatedSolver.
class ContactSolver {
 public:
  //! Adds to the work of `audit`, which outlives this, while that is on.
  explicit ContactSolver(ImpulseAudit& audit) : audit_(audit) {}

  //! Changes the velocities of `bodies`, which can all move, and by split impulses their positions where they overlap.
  //! `manifolds` have at least one of them each. Returns whether it converged.
  bool solve(const std::vector<btRigidBody*>& bodies, const std::vector<btPersistentManifold*>& manifolds,
             const std::vector<Motor>& motors, const btContactSolverInfo& info);

 private:
  struct MovingBody {
    btRigidBody* rigid;
    btVector3 inverse_masses;  // along each axis of the world, 0 along locked ones [1/kg]
    btVector3 gyroscopic;      // change of angular velocity in this step [rad/s]
  };

  struct Ends {  // of a contact: moving bodies, or -1, and the arms from their centres of mass
    int slot_a, slot_b;
    btVector3 arm_a, arm_b;
  };

  void add_bodies(const std::vector<btRigidBody*>& bodies, const btContactSolverInfo& info);
  void add_motor(const Motor& motor, const btContactSolverInfo& info);
  void add_contacts(btPersistentManifold& manifold, const btContactSolverInfo& info);
  void add_normal(btManifoldPoint& point, const Ends& ends, const btContactSolverInfo& info);
  void add_friction(const btManifoldPoint& point, std::size_t normal, const btVector3& direction,
                    const btVector3& before, double& stored, const Ends& ends);
  void set_sides(ContactRow& row, const btVector3& direction, const Ends& ends) const;
  double set_side(RowSide& side, int slot, const btVector3& direction, const btVector3& arm) const;
  double asked_before(const ContactRow& row, bool gyroscopic) const;
  btVector3 velocity(int slot, const btVector3& arm) const;
  bool iterate(const btContactSolverInfo& info);
  void write_back(const btContactSolverInfo& info);
  void add_work(const btContactSolverInfo& info);
  double work_of(const ContactRow& row) const;
  double work_on_kinematic(const ContactRow& row) const;
  double scaled_speed(const RowSide& side) const;
  int slot_of(const btCollisionObject& object) const;

  std::vector<MovingBody> moving_;
  std::vector<int> slots_;  // of bodies by their index in the scene; -1: fixed
  ContactRows rows_;
  ImpulseAudit& audit_;
};

}  // namespace energymargin
