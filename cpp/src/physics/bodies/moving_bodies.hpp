#pragma once
// All bodies of a scene: those on their own, and trees of links.

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <optional>
#include <vector>

#include "physics/bodies/articulation.hpp"
#include "physics/bodies/rigid_bodies.hpp"

namespace energymargin {

//! A joint that follows another one, on the same tree or on two.
struct MimicConstraint {
  struct End {
    std::size_t tree;
    int link;
  };
  End follower, followed;
  Mimic mimic;
};

//! Where the bodies are, how they move and what acts on them.
class MovingBodies {
 public:
  //! The scene outlives this.
  explicit MovingBodies(const Scene& scene);

  //! All bodies, in the scene's order.
  const std::vector<btCollisionObject*>& colliders() const { return colliders_; }

  //! Free bodies of role "object", in the scene's order.
  const std::vector<btRigidBody*>& objects() const { return rigids_.objects(); }

  RigidBodies& rigids() { return rigids_; }
  const std::vector<std::unique_ptr<Articulation>>& trees() const { return trees_; }
  const std::vector<MimicConstraint>& mimics() const { return mimics_; }

  //! The tree that a body is in.
  const std::optional<std::size_t>& tree_of(std::size_t body) const { return tree_of_[body]; }

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

  //! Only constant forces act on the bodies, beside gravity; then another wrench does.
  void clear_loads();
  void apply(const Load& load);

  //! Target of a joint, until the next `restore`.
  void set_target(std::size_t joint, double target);
  double target(std::size_t joint) const;

  //! Moves all on their ways, for a share of `duration` [s].
  void move(double duration, double share);

  //! The body itself, or the one that its tree hangs on.
  std::size_t base_of(std::size_t body) const;

  //! Moves a body, with the tree whose free base it is, with what turns about `origin` and moves like `carrier`.
  void carry(std::size_t base, const Velocity& carrier, const btVector3& origin, double duration);

 private:
  void add_trees();
  void add_mimics();
  JointControl* control_of(std::size_t joint) const;  // null for one without

  const Scene& scene_;
  RigidBodies rigids_;
  std::vector<btCollisionObject*> colliders_;
  std::vector<std::unique_ptr<Articulation>> trees_;
  std::vector<std::optional<std::size_t>> tree_of_;
  std::vector<Load> link_loads_;  // constant forces on bodies of trees
  std::vector<MimicConstraint> mimics_;
};

}  // namespace energymargin
