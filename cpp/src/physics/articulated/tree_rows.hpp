#pragma once
// The solver's rounds over the constraints of bodies on joints.

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodySolverConstraint.h>
#include <btBulletDynamicsCommon.h>

#include <vector>

namespace energymargin {

//! Does what btMultiBodyConstraintSolver does in a round, to the same bits but for friction, whose cone it finds
//! without an angle. What makes it faster: most numbers of a row's Jacobian are zero, as those of a fixed base, or of
//! all joints but the one that is driven; they are looked for once a step, and left out.
class TreeRows {
 public:
  using Constraints = btAlignedObjectArray<btMultiBodySolverConstraint>;

  //! For the rounds of one step; the arguments stay in place until `finish`. `friction` has two rows a contact.
  void start(Constraints& joints, Constraints& normal, Constraints& friction, btMultiBodyJacobianData& data,
             btAlignedObjectArray<btSolverBody>& bodies);

  //! One round, with `joint_rounds` over the joints' own rows; returns the largest square of a change of velocity.
  double iterate(int round, int joint_rounds);

  //! Writes the impulses back, and the changes to the trees.
  void finish();

 private:
  struct Span {  // of numbers that are not all zero
    int begin = 0;
    int count = 0;
  };

  struct Side {
    btSolverBody* body = nullptr;  // a free body; else a tree, or a fixed body, which has no numbers
    btVector3 linear, angular;     // of the row
    btVector3 linear_change, angular_change;
    const double* jacobian = nullptr;
    const double* response = nullptr;  // change of the tree's velocities by an impulse of 1
    double* changes = nullptr;         // so far
    Span nonzero_jacobian, nonzero_response;

    double speed() const;
    void push(double impulse) const;
  };

  struct Row {
    btMultiBodySolverConstraint* constraint;
    Side a, b;
    double target, effective_mass, softness, impulse, low, high;

    double unclamped_change() const;
    void push(double impulse) const;
  };

  struct Tree {
    btMultiBody* body;
    const double* changes;  // in the solver's data
    std::size_t at_start;   // where they begin in `at_start_`
  };

  Side side(int solver_body, btMultiBody* tree, int jacobian, int changes);
  void save_changes(btMultiBody& tree, const double* changes);
  Row row(btMultiBodySolverConstraint& constraint);
  static double resolve(Row& row);
  static double resolve_cone(Row& first, Row& second, double radius);

  btMultiBodyJacobianData* data_ = nullptr;
  btAlignedObjectArray<btSolverBody>* bodies_ = nullptr;
  std::vector<Row> joints_, normal_, friction_;
  std::vector<Tree> trees_;
  std::vector<double> at_start_;  // changes at the start of the rounds, of one tree after the other
};

}  // namespace energymargin
