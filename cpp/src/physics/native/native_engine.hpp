#pragma once
// The library's own dynamics: exact friction, continuous collision.

#include <vector>

#include "physics/engine.hpp"
#include "physics/native/step_equations.hpp"

namespace energymargin {

class NativeEngine : public Engine {
 public:
  explicit NativeEngine(const Scene& scene)
      : Engine(scene), equations_(scene_, bodies_), ways_(scene_.bodies().size()) {}

  //! By less than what is left where bodies come into contact on the way: in no time at all where some bounce. After
  //! too many substeps the rest is lost: velocities change, and nothing moves further than into contact.
  SubstepResult advance(double left) override;

  ImpulseAudit* impulses() override { return &equations_.audit; }

 protected:
  void forget() override {
    substeps_ = touches_ = blows_ = 0;
    pairs_.forget();
  }
  const std::vector<double>& pushed(std::size_t tree) const override { return equations_.pushed(tree); }

 private:
  void settle();
  SubstepResult blow();

  int substeps_ = 0, touches_ = 0, blows_ = 0;  // of this step
  StepEquations equations_;
  std::vector<Velocity> ways_;  // of all bodies
};

}  // namespace energymargin
