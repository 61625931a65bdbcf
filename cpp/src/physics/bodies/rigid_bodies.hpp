#pragma once
// The bodies of a scene that hang on no joint, and its fixed ones, as Bullet's rigid bodies.

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/state.hpp"
#include "physics/motion.hpp"
#include "physics/shapes.hpp"

namespace energymargin {

//! As MovingBodies has them, for these bodies alone. The user index of each is that of its body in the scene.
class RigidBodies {
 public:
  //! The scene outlives this.
  explicit RigidBodies(const Scene& scene);

  //! Fixed ones too; in a scene without joints each at the index of its body.
  const std::vector<std::unique_ptr<btRigidBody>>& all() const { return all_; }
  const std::vector<btRigidBody*>& moving() const { return moving_; }
  const std::vector<btRigidBody*>& objects() const { return objects_; }

  void restore(const State& state);
  void read(State& state) const;
  void read(std::vector<Velocity>& velocities) const;
  void read(Motion& motion) const;

  //! A wrench on the body with this index in the scene, until `clear_loads`, beside gravity and its constant force.
  void apply(const Load& load);
  void clear_loads();

  //! Change of the i-th moving body's velocities by its loads, per second [m/s^2]; and its torque [N m].
  btVector3 acceleration(std::size_t i) const;
  const btVector3& torque(std::size_t i) const { return loads_[i].torque; }

  //! How the i-th moving body goes in this substep; without contacts, and with no turn to speak of, at its velocities.
  void set_way(std::size_t i, const Velocity& way) { ways_[i] = way; }
  void read_ways(std::vector<Velocity>& velocities) const;

  //! Moves all on their ways, for a share of `duration` [s]. A kinematic body loses no time.
  void move(double duration, double share);

  //! Moment of inertia of the i-th moving body in the world [kg m^2], and its principal moments.
  btMatrix3x3 inertia(std::size_t i) const;
  const btVector3& moments(std::size_t i) const { return free_[i].moments; }

 private:
  struct Free {
    int offset;  // in a state
    Inertial inertial;
    btVector3 moments;       // principal [kg m^2]
    btVector3 acceleration;  // of gravity and the body's constant force [m/s^2]
  };
  void add(const Scene& scene, std::size_t index);

  StateLayout layout_;
  std::vector<std::unique_ptr<btRigidBody>> all_;
  std::vector<btRigidBody*> moving_, objects_;
  std::vector<Free> free_;   // of each that moves
  std::vector<Load> loads_;  // of each that moves
  std::vector<Velocity> ways_;
  std::vector<int> slots_;  // among those that move, by the index in the scene; -1: none
};

//! Whether no impulse changes how a body moves, that is not fixed.
inline bool is_kinematic(const btRigidBody& body) { return body.getInvMass() == 0.0 && !body.isStaticObject(); }

}  // namespace energymargin
