#pragma once
// How far a state is from the edge of a region.

#include <functional>

#include "energymargin/region.hpp"

namespace energymargin {

//! The signed distance of states to the edge of a region, as a share of the start's: negative inside, 0 at the edge,
//! positive outside. Each primitive is divided by the size of its distance at the start, so that metres, metres a
//! second and angles compare; & is the largest of its parts, | the least, ~ the negative.
class SignedDistance {
 public:
  //! Throws std::invalid_argument on a body that the scene does not have, and on a Predicate, which has no distance.
  SignedDistance(const Region& region, const Scene& scene, const State& start);

  double operator()(const State& state) const { return distance_(state.data()); }

 private:
  std::function<double(const double*)> distance_;
};

}  // namespace energymargin
