#pragma once
// Which states lie in a region: a region whose names have been looked up in a scene.

#include <functional>

#include "energymargin/region.hpp"

namespace energymargin {

//! The predicate that the search calls.
class Membership {
 public:
  //! Throws std::invalid_argument if the region names a body that the scene does not have.
  Membership(const Region& region, const Scene& scene);

  bool operator()(const State& state) const { return test_(state.data()); }

  //! One value a row.
  Mask operator()(const States& states) const;

 private:
  std::function<bool(const double*)> test_;
  std::function<Mask(const States&)> test_all_;  //!< set where the region is one predicate
};

}  // namespace energymargin
