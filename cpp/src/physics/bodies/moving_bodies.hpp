#pragma once
// All bodies of a scene: those on their own, and trees of links.

#include <memory>
#include <optional>
#include <vector>

#include "physics/bodies/articulation.hpp"

namespace energymargin {

//! A body that moves and hangs on no joint.
struct FreeBody {
  std::size_t body;  // in the scene
  int offset;        // in a state
  bool kinematic;
  double inverse_mass;      // 0: kinematic [1/kg]
  btVector3 moments;        // principal [kg m^2]
  btVector3 linear_factor;  // 1: free along the axis, 0: locked
  btVector3 angular_factor;
  btVector3 acceleration;   // of gravity and the body's constant force [m/s^2]
  std::vector<int> axes{};  // that are not locked: 0..2 linear, 3..5 angular; none of a kinematic body
  Velocity velocity{};
  btVector3 force = btVector3(0, 0, 0), torque = btVector3(0, 0, 0);  // on it in the next substep
  Velocity way{};                                                     // at which it goes in this substep

  // In the equations of the substep:
  int mover = -1;                          // of the solver; -1: kinematic
  btVector3 turning = btVector3(0, 0, 0);  // angular acceleration as it coasts [rad/s^2]
  Velocity pushed{};                       // after loads and impulses, before it coasts
  btVector3 spin = btVector3(0, 0, 0);     // angular velocity at the end of the substep [rad/s]
};

//! A link, or the free base of a tree.
struct TreeLink {
  std::size_t tree;
  int link;
};

//! A sum of joints' positions, each times a coefficient: joints of one tree, or of two.
struct JointSum {
  struct Term {
    TreeLink link;
    double coefficient;
  };
  std::vector<Term> terms{};
};

//! A joint that follows another one: the sum is constant.
struct MimicConstraint : JointSum {
  double constant;
};

//! A tendon, whose length is the sum.
struct TendonControl : JointSum, Control {
  const Tendon* tendon;  // the scene's
};

//! A frame of one body that stays at one of another: the scene's loop, by the bodies' centres and principal axes.
struct LoopConstraint {
  bool weld;
  std::size_t a, b;
  btTransform in_a, in_b;
};

//! Where the bodies are, how they move and what acts on them.
class MovingBodies {
 public:
  //! The scene outlives this.
  explicit MovingBodies(const Scene& scene);
  MovingBodies(const MovingBodies&) = delete;  // the trees refer to the poses
  MovingBodies& operator=(const MovingBodies&) = delete;

  //! Bullet's frames of all bodies, in the scene's order.
  const std::vector<btTransform>& poses() const { return poses_; }

  std::vector<FreeBody>& free() { return free_; }

  //! Null for one that is fixed or on a tree.
  FreeBody* free(std::size_t body) const { return free_of_[body]; }

  const std::vector<std::unique_ptr<Articulation>>& trees() const { return trees_; }
  const std::vector<MimicConstraint>& mimics() const { return mimics_; }
  const std::vector<TendonControl>& tendons() const { return tendons_; }
  const std::vector<LoopConstraint>& loops() const { return loops_; }

  //! Where a body is in a tree, if it is in one.
  const std::optional<TreeLink>& link(std::size_t body) const { return links_[body]; }

  //! Puts all bodies where a state says; nothing of the past is left.
  void restore(const State& state);

  //! Writes the bodies' numbers into a state of the scene's dimension.
  void read(State& state) const;

  //! Reads the velocities of all bodies that move, each at the index of its body in the scene, or those at which they
  //! go on their ways.
  void read(std::vector<Velocity>& velocities) const;
  void read_ways(std::vector<Velocity>& velocities) const;

  //! Reads velocities and loads, without those of springs.
  void read(Motion& motion) const;

  //! Velocity of the point of a body that is at `point` in the world [m/s].
  btVector3 velocity(std::size_t body, const btVector3& point) const;

  //! Moment of inertia of a body in the world [kg m^2].
  btMatrix3x3 inertia(const FreeBody& free) const;

  //! Only constant forces act on the bodies, beside gravity; then another wrench does.
  void clear_loads();
  void apply(const Load& load);

  //! Target of a joint or, beyond all joints, a tendon, until the next `restore`.
  void set_target(std::size_t index, double target);
  double target(std::size_t index) const;

  //! Moves all on their ways, for a share of `duration` [s]; a kinematic body loses no time.
  void move(double duration, double share);

  //! The body itself, or the one that its tree hangs on.
  std::size_t base_of(std::size_t body) const;

  //! Moves a body, with the tree whose free base it is, with what turns about `origin` and moves like `carrier`.
  void carry(std::size_t base, const Velocity& carrier, const btVector3& origin, double duration);

 private:
  void add_free(std::size_t body, int offset);
  void add_trees();
  void add_sums();
  void add_loops();
  Control* control_of(std::size_t index) const;  // null for a joint without

  const Scene& scene_;
  std::vector<btTransform> poses_;
  std::vector<FreeBody> free_;
  std::vector<FreeBody*> free_of_;  // of all bodies; null: fixed, or on a tree
  std::vector<std::unique_ptr<Articulation>> trees_;
  std::vector<std::optional<TreeLink>> links_;  // of all bodies
  std::vector<Load> link_loads_;                // constant forces on bodies of trees
  std::vector<MimicConstraint> mimics_;
  mutable std::vector<TendonControl> tendons_;
  std::vector<LoopConstraint> loops_;
};

}  // namespace energymargin
