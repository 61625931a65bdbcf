#pragma once
// Bullet's own dynamics: sequential impulses on a multi-body world, one step without substeps.

#include <memory>

#include "physics/engine.hpp"

namespace energymargin {

class BulletEngine : public Engine {
 public:
  //! Throws std::invalid_argument on what Bullet cannot do, by name.
  explicit BulletEngine(const Scene& scene);
  ~BulletEngine() override;

  //! The whole step.
  SubstepResult advance(double left) override;

 protected:
  void forget() override;
  const std::vector<double>& pushed(std::size_t tree) const override { return bodies_.trees()[tree]->velocities(); }

 private:
  struct Bullet;  // the world and what is in it
  void load(double duration);
  void add_motor(const Motor& motor);
  void read_back();
  void read_contacts();

  std::unique_ptr<Bullet> bullet_;
};

}  // namespace energymargin
