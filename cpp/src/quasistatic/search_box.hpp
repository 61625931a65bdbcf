#pragma once
// The box around the start in which an escape is searched for.

#include <optional>
#include <vector>

#include "energymargin/limit.hpp"
#include "quasistatic/landscape.hpp"
#include "quasistatic/pose_sampler.hpp"

namespace energymargin::quasistatic {

struct SearchBox {
  double reach = 0.0;           //!< half its edge [m]
  std::vector<Pose> outside{};  //!< poses in it outside of the capture set, settled
};

//! Of half edge `reach` or, if that is unset, large enough for a fair share of its free poses to be outside of the
//! capture set. None if the limit was reached first. Leaves the sampler with another reach. Throws
//! std::invalid_argument if no pose outside is found.
std::optional<SearchBox> find_search_box(Landscape& landscape, PoseSampler& sampler, const std::optional<double>& reach,
                                         const Limit& limit);

}  // namespace energymargin::quasistatic
