#pragma once
// Draws poses of the object below a bound on its energy.

#include <ompl/util/RandomNumbers.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "energymargin/limit.hpp"
#include "quasistatic/landscape.hpp"

namespace energymargin::quasistatic {

class PoseSampler {
 public:
  //! A draw that reaches the limit ends without a result.
  PoseSampler(Landscape& landscape, std::uint64_t seed, const Limit& limit);

  //! Finds the box around the start to draw from: of half edge `reach` or, if that is unset, large enough for a fair
  //! share of its free poses to be outside of the capture set. Gives the poses outside, settled, that it drew; none if
  //! the limit was reached first. Throws std::invalid_argument if no pose outside is found.
  std::optional<std::vector<Pose>> find_box(const std::optional<double>& reach);

  //! Half the edge of that box [m].
  double reach() const { return reach_; }

  //! An allowed pose with an energy below `bound` [J]; none if a number of tries was in vain. Some are drawn
  //! around the `known` ones.
  std::optional<Pose> draw(double bound, Side side, const std::vector<Pose>& known = {});

  //! A pose nearby: as far as about `scale` [m] away.
  Pose draw_near(const Pose& pose, double scale);

  //! A whole number below `end`, a small one rather than a large one.
  std::size_t draw_index(std::size_t end);

 private:
  std::vector<Pose> draw_outside(int poses);
  Pose draw_in_box(double bound);
  Quaternion draw_orientation();
  Pose draw_along_axis(const std::vector<Pose>& known);
  double below_bound(int axis, double bound, double reach) const;
  double draw_log_uniform(double least, double most);

  Landscape& landscape_;
  ompl::RNG rng_;
  Limit limit_;
  double reach_ = 0.0;
  bool may_grow_ = false;
};

}  // namespace energymargin::quasistatic
