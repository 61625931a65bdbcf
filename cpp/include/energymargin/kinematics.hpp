#pragma once
// Where every body of a scene is in a state: links follow from the joints.

#include <optional>
#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"

namespace energymargin {

//! Where the child of a joint is, and how it moves, from the joint's parent.
BodyState child_state(const Joint& joint, const JointState& state, const BodyState& parent);

//! Where a point of a body is, and how it moves; the point is in the body's frame [m].
BodyState state_at_point(const Vector3& point, const BodyState& body);

//! Forward kinematics of a scene.
class Kinematics {
 public:
  explicit Kinematics(const Scene& scene);

  //! A body by its index in the scene, for the state vector that starts at `state`.
  BodyState operator()(const double* state, std::size_t body) const;

 private:
  struct Node {
    BodyState fixed;             // where it is if no number of the state says so
    int offset;                  // in a state; -1: fixed, or a link
    std::optional<Joint> joint;  // that carries it
    std::size_t joint_index;
    std::size_t parent;
  };

  StateLayout layout_;
  std::vector<Node> nodes_;
};

}  // namespace energymargin
