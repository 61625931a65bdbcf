#pragma once
// The bodies of a scene that hang on no joint, and its fixed ones, as Bullet's rigid bodies.

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <optional>
#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"
#include "physics/impulse_work.hpp"
#include "physics/load.hpp"
#include "physics/shapes.hpp"
#include "physics/velocity.hpp"

namespace energymargin {

//! As Stepper has them, for these bodies alone. The user index of each is that of its body in the scene.
class RigidBodies {
 public:
  //! `shapes` are those of the scene's bodies, and outlive this.
  RigidBodies(const Scene& scene, const std::vector<CollisionShape>& shapes);

  //! Fixed ones too; in a scene without joints each at the index of its body.
  const std::vector<std::unique_ptr<btRigidBody>>& all() const { return all_; }
  const std::vector<btRigidBody*>& moving() const { return moving_; }
  const std::vector<btRigidBody*>& objects() const { return objects_; }

  void restore(const State& state);
  void read(State& state) const;
  void read(std::vector<Velocity>& velocities) const;
  void read(Motion& motion) const;
  void accelerate(double duration);
  void save();
  void undo();
  void undo_split_impulses();
  void move(double duration, double share);

 private:
  struct Free {
    int offset;  // in a state
    Inertial inertial;
    btVector3 acceleration;           // of gravity and the body's constant force [m/s^2]
    std::optional<int> turning_axis;  // the only axis of the world about which it can turn, if it is one
  };
  struct Snapshot {
    btTransform pose;
    Velocity velocity;
  };

  void add(const Scene& scene, std::size_t index, btCollisionShape& shape);
  static void make_kinematic(btRigidBody& rigid);
  void set_moment(std::size_t free);

  StateLayout layout_;
  std::vector<std::unique_ptr<btRigidBody>> all_;
  std::vector<btRigidBody*> moving_, objects_;
  std::vector<Free> free_;  // of each that moves
  std::vector<Snapshot> snapshots_;
};

void apply_load(btRigidBody& body, const Load& load, double duration);

//! Whether no impulse changes how a body moves, that is not fixed.
inline bool is_kinematic(const btRigidBody& body) { return body.getInvMass() == 0.0 && !body.isStaticObject(); }

//! Gives a kinematic body the velocities of a motor, but along and about locked axes.
void set_velocities(btRigidBody& body, const Motor& motor);

//! Velocity of the point of a body that is at `point` in the world [m/s].
btVector3 velocity_at(const btRigidBody& body, const btVector3& point);

}  // namespace energymargin
