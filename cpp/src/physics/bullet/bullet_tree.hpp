#pragma once
// A tree of links as one of Bullet's multi-bodies.

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "energymargin/state.hpp"
#include "physics/bodies/moving_bodies.hpp"

namespace energymargin {

//! One of a multi-body's velocities, of its free base (angular first) or a joint, and its coefficient in a sum.
struct BulletTerm {
  btMultiBody* body;
  int velocity;
  double coefficient;

  static BulletTerm of_joint(btMultiBody& body, int link, double coefficient) {
    return {&body, velocities_of_free_body + body.getLink(link).m_dofOffset, coefficient};
  }
};

//! Force and torque [N, N m] with which a body's damping slows it in a step, as if at its speed after it: however much
//! of it there is, nothing turns round. `axes` are the principal ones of its moments.
Velocity damping_of(const Body& body, const Velocity& velocity, double mass, const btVector3& moments,
                    const btMatrix3x3& axes, double duration);

//! Rows of Bullet's solver over velocities of one multi-body or two; link -1 is the base.
class BulletRows : public btMultiBodyConstraint {
 public:
  BulletRows(btMultiBody& body, int link, btMultiBody* other, int other_link, int rows);

  //! The solver goes on from the last step's impulses.
  void forget();

  void finalizeMultiDof() override {}
  int getIslandIdA() const override { return island(*m_bodyA, m_linkA); }
  int getIslandIdB() const override { return m_bodyB ? island(*m_bodyB, m_linkB) : -1; }
  void debugDraw(btIDebugDraw*) override {}

 protected:
  //! A row that gives the sum of the velocities a target, without limits.
  btMultiBodySolverConstraint& add_row(int number, const std::vector<BulletTerm>& terms, double target,
                                       btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data);

  static void limit(btMultiBodySolverConstraint& row, double impulse);

 private:
  static int island(btMultiBody& body, int link) {
    return (link < 0 ? body.getBaseCollider() : body.getLink(link).m_collider)->getIslandTag();
  }

  //! Of the row's terms those of one body: the indices of its numbers, its inverse mass and its speed along the row.
  struct Side {
    int velocities, jacobian;
    double inverse_mass, velocity;
  };
  static Side add_side(btMultiBody& body, const std::vector<BulletTerm>& terms, btMultiBodyJacobianData& data);
};

//! A joint's drive, dry friction and stops, by the library's laws: an implicit spring and damper within its torque
//! limit, and stops that the joint may not cross in a step.
class BulletJoint : public BulletRows {
 public:
  //! `control` is null for a joint without drive and stops.
  BulletJoint(btMultiBody& body, int link, const Joint& joint, const JointControl* control)
      : BulletRows(body, link, nullptr, -1, 4), joint_(joint), control_(control) {}
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override;

 private:
  const Joint& joint_;
  const JointControl* control_;
};

//! A joint that follows another one: the sum of both terms is constant.
class BulletMimic : public BulletRows {
 public:
  struct Side {
    btMultiBody& body;
    int link;
    double coefficient;
  };

  BulletMimic(const Side& one, const Side& other, double constant)
      : BulletRows(one.body, one.link, &one.body == &other.body ? nullptr : &other.body, other.link, 1),
        sides_{one, other},
        constant_(constant) {}
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override;

 private:
  std::array<Side, 2> sides_;
  double constant_;
};

//! A motor of a tree's free base, in one step.
class BulletBaseMotor : public BulletRows {
 public:
  BulletBaseMotor(btMultiBody& body, const Motor& motor)
      : BulletRows(body, -1, nullptr, -1, velocities_of_free_body), motor_(motor) {}
  void createConstraintRows(btMultiBodyConstraintArray& rows, btMultiBodyJacobianData& data,
                            const btContactSolverInfo& info) override;

 private:
  Motor motor_;
};

//! The library's tree, as Bullet steps it.
class BulletTree {
 public:
  //! Both outlive this.
  BulletTree(const Scene& scene, Articulation& tree);

  btMultiBody& body() { return *body_; }
  const std::vector<std::unique_ptr<btMultiBodyLinkCollider>>& colliders() const { return colliders_; }
  const std::vector<std::unique_ptr<BulletRows>>& rows() const { return rows_; }

  //! In Bullet's numbers, from the tree's index of a link.
  static int link(int index) { return index - 1; }
  BulletMimic::Side side(const JointSum::Term& of) const { return {*body_, link(of.link.link), of.coefficient}; }

  //! Puts it where the tree is.
  void restore();

  //! What acts on the tree's links in the next step, of `duration` [s].
  void load(const Vector3& gravity, double duration);

  //! After a step.
  void read(State& state);

 private:
  void set_up(int index);
  void drive_base(double duration);
  void add_collider(std::size_t of_scene, int link);

  const Scene& scene_;
  StateLayout layout_;
  Articulation& tree_;
  double heaviness_ = 0.0;  // of a kinematic base [kg], [kg m^2]
  btTransform driven_{};    // where that is after the step
  std::unique_ptr<btMultiBody> body_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders_;
  std::vector<std::unique_ptr<BulletRows>> rows_;
};

}  // namespace energymargin
