#pragma once
// How far a state is from the edge of a region.

#include <functional>
#include <vector>

#include "energymargin/region.hpp"

namespace energymargin {

//! The signed distance of states to the edge of a region, negative inside. Each primitive's is divided by its size at
//! the start, so that metres and angles compare; & is the largest of its parts, | the least, ~ the negative.
class SignedDistance {
 public:
  //! Throws std::invalid_argument on a body that the scene does not have, and on a Predicate, which has no distance.
  SignedDistance(const Region& region, const Scene& scene, const State& start);

  double operator()(const State& state) const;

  //! What each primitive reads of a state, one after another: its distance changes by no more than that.
  std::vector<double> coordinates(const State& state) const;

  //! How many are those of each primitive.
  const std::vector<int>& sizes() const { return sizes_; }

  //! The distance at such coordinates, with that of each primitive in a unit of the caller's.
  double at(const double* coordinates, const double* units) const { return distance_(coordinates, units); }

 private:
  std::vector<int> sizes_;
  std::vector<double> units_;  // distances of the primitives at the start
  std::vector<std::function<void(const double*, double*)>> readers_;
  std::function<double(const double*, const double*)> distance_;
};

}  // namespace energymargin
