#pragma once
// Links that hang together, as one of Bullet's articulated bodies.

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <memory>
#include <optional>
#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"
#include "physics/articulated/joint_rows.hpp"
#include "physics/impulse_work.hpp"
#include "physics/load.hpp"
#include "physics/shapes.hpp"
#include "physics/velocity.hpp"

namespace energymargin {

//! A tree of links on its base: a free body, or a fixed one that stays what it is outside of the tree.
class Articulation {
 public:
  //! The links on a free body `base`, or those on one fixed body that hang on joint `first`. `shapes` are the bodies'.
  Articulation(const Scene& scene, const std::vector<CollisionShape>& shapes, std::size_t base,
               std::optional<std::size_t> first);
  Articulation(const Articulation&) = delete;
  Articulation& operator=(const Articulation&) = delete;

  //! The colliders, with the index of their body in the scene as user index.
  const std::vector<std::unique_ptr<btMultiBodyLinkCollider>>& colliders() const { return colliders_; }

  //! None for a joint of another tree.
  std::optional<JointPlace> place_of(std::size_t joint) const;

  //! As Bullet has it.
  btMultiBody& multi_body() { return *body_; }
  const btMultiBody& multi_body() const { return *body_; }

  //! The drives and stops of the joints.
  std::vector<btMultiBodyConstraint*> constraints() const;

  void restore(const State& state);
  void read(State& state) const;

  //! Velocities of the links and of a free base, each at the index of its body in the scene.
  void read(std::vector<Velocity>& velocities) const;
  void read(Motion& motion) const;

  //! Velocities of the base, then of the joints.
  void read_velocities(std::vector<double>& velocities) const;

  //! Also clears forces.
  void restore_velocities(const std::vector<double>& velocities);

  //! A wrench in the next step, at the centre of mass of a body of the tree.
  void apply(const btMultiBodyLinkCollider& body, const btVector3& force, const btVector3& torque);

  //! Velocity of the point of a body of the tree that is at `point` in the world.
  btVector3 velocity(const btMultiBodyLinkCollider& body, const btVector3& point) const;

  //! Moves the target of a joint until the next `restore`; a joint of another tree is none of its business.
  void set_target(std::size_t joint, double target);
  std::optional<double> target(std::size_t joint) const;

 private:
  struct LinkVelocities {
    std::vector<btVector3> angular, linear;  // of the base, then of the links, each in its own axes
  };
  struct Link {
    std::size_t joint;  // in the scene
    int parent;         // among the links; -1: the base
    bool rigid;         // fixed, held, or following a held joint
    Quaternion turn;    // from vectors in the parent's principal axes to those in the link's, at position 0
    Vector3 axis;       // in the link's principal axes
    Vector3 pivot;      // in the parent's principal axes
    std::unique_ptr<JointRows> rows{};  // unset: rigid, or following another joint
    double held = 0.0;                  // where a rigid one is
  };

  const LinkVelocities& link_velocities() const;
  void find_links(std::size_t parent, int parent_link, std::optional<std::size_t> only);
  bool rigid(const Joint& joint) const;
  void set_up(int link);
  void hold(int link);
  void add_collider(btCollisionShape& shape, std::size_t body, int link);

  const Scene& scene_;
  StateLayout layout_;
  std::size_t base_;
  std::vector<Inertial> inertials_;  // of each body of the scene
  std::vector<Link> links_;
  std::unique_ptr<btMultiBody> body_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders_;
  btAlignedObjectArray<btQuaternion> rotations_;  // scratch of Bullet's forward kinematics
  btAlignedObjectArray<btVector3> origins_;
  mutable LinkVelocities scratch_;
};

}  // namespace energymargin
