#pragma once
// The step of a scene without joints.

#include "physics/free_bodies/contact_solver.hpp"
#include "physics/rigid_bodies.hpp"
#include "physics/stepper.hpp"

namespace energymargin {

//! Free and fixed bodies in contact. One step does what Bullet's world does in one, to the same bits but for the order
//! of several contacts of one pair of compounds, and without what these scenes have no use for: sleep, islands, swept
//! bounds, and a search for the few pairs that there are.
class FreeBodies : public Stepper {
 public:
  FreeBodies(const Scene& scene, const std::vector<CollisionShape>& shapes);

  const std::vector<btRigidBody*>& objects() const override { return bodies_.objects(); }
  void restore(const State& state) override { bodies_.restore(state); }
  void read(State& state) const override { bodies_.read(state); }
  void read(std::vector<Velocity>& velocities) const override { bodies_.read(velocities); }
  void read(Motion& motion) const override { bodies_.read(motion); }
  btVector3 velocity(std::size_t body, const btVector3& point) const override;
  void apply(const Load& load, double duration) override;
  void accelerate(double duration) override { bodies_.accelerate(duration); }
  void save() override { bodies_.save(); }
  void undo() override { bodies_.undo(); }
  void undo_split_impulses() override { bodies_.undo_split_impulses(); }
  bool solve(const StepPart& part) override;
  void move(double duration, double share) override { bodies_.move(duration, share); }

 private:
  RigidBodies bodies_;
  ContactSolver solver_;
};

}  // namespace energymargin
