#pragma once
// The grid in which EST and other planners count states.

#include <ompl/base/ProjectionEvaluator.h>

namespace energymargin::search {

class CostSpace;

//! Six coordinates an object, so that no motion of one makes up for that of another: its change of position and of
//! orientation since the start. Then the cost, below a finite bound, and with a horizon the time. Cells are of size 1.
class Projection : public ompl::base::ProjectionEvaluator {
 public:
  //! The space has to outlive this.
  explicit Projection(const CostSpace& space);

  unsigned int getDimension() const override;

  //! Throws std::domain_error if a coordinate is nan: the node's state is not finite.
  void project(const ompl::base::State* state, Eigen::Ref<Eigen::VectorXd> projection) const override;

 private:
  unsigned int timeless_dimension() const;

  const CostSpace& cost_space_;
};

}  // namespace energymargin::search
