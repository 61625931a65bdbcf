#pragma once
// Where an object may be: X_free of Definition 1, the poses in which it penetrates nothing.

#include <memory>

#include "energymargin/scene.hpp"
#include "energymargin/types.hpp"

namespace energymargin {

//! The free space of one object while everything else stays where it is. An object that touches is free: it may be as
//! deep in a body as at the start, and a little deeper. One thread at a time.
class FreeSpace {
 public:
  //! `object` is the index of a body that moves freely; `state` says where everything is.
  FreeSpace(const Scene& scene, const State& state, std::size_t object);
  ~FreeSpace();

  //! How far every point of the object can move before it is in anything [m], up to `reach`; negative: not free. `pose`
  //! is that of the body's frame.
  double clearance(const Pose& pose, double reach);

  //! How much deeper than at the start the object may be in a body [m]: so that it can slide along what it rests on.
  double tolerance() const;

 private:
  class Bullet;
  std::unique_ptr<Bullet> bullet_;
};

}  // namespace energymargin
