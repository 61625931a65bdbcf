#pragma once
// The potential energy of one body while everything else stays where it is: E of Definition 2.

#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/types.hpp"

namespace energymargin::quasistatic {

class Potential {
 public:
  //! `body` is an index in the scene; `state` says where everything else is.
  Potential(const Scene& scene, const State& state, std::size_t body);

  //! Of gravity and the body's constant force, with its zero at the world's origin, and of the springs on it [J].
  double operator()(const Pose& pose) const;

  //! What pulls at the body [N]: minus the slope of the energy in the position.
  Vector3 force(const Pose& pose) const;

  //! Gravity and the constant force alone [N].
  const Vector3& load() const { return load_; }
  bool has_springs() const { return !springs_.empty(); }

  //! Whether a turn about the frame's origin changes it.
  bool turns() const;

 private:
  struct End {       // of a spring, at the body
    Vector3 point;   // in the body's frame
    Vector3 anchor;  // the other end, in the world
    double stiffness, rest_length;
  };

  Vector3 load_, center_;
  std::vector<End> springs_;
};

}  // namespace energymargin::quasistatic
