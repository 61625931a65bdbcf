#pragma once
// Draws poses of the object below a bound on its energy.

#include <ompl/util/RandomNumbers.h>

#include <atomic>
#include <cstdint>
#include <optional>

#include "energymargin/quasistatics.hpp"

namespace energymargin::search {

class PoseSampler {
 public:
  //! `stop`, if given, ends a draw without a result.
  PoseSampler(Quasistatics& statics, std::uint64_t seed, const std::atomic<bool>* stop);

  //! Half the edge of the box around the start that positions are drawn from [m].
  double reach() const { return reach_; }
  void set_reach(double reach) { reach_ = reach; }

  //! Where to draw.
  enum class Side {
    captured,  ///< in the capture set: a way out ends where it leaves that
    outside,   ///< settled as low as it gets outside
    any,
  };

  //! An allowed pose with an energy below `bound` [J]; none if a number of tries was in vain.
  std::optional<Pose> draw(double bound, Side side);

  //! A pose nearby: as far as about `scale` [m] away.
  Pose near(const Pose& pose, double scale);

 private:
  Pose anywhere(double bound);
  double below(int axis, double bound) const;

  Quasistatics& statics_;
  ompl::RNG rng_;
  const std::atomic<bool>* stop_;
  double reach_ = 0.0;
};

}  // namespace energymargin::search
