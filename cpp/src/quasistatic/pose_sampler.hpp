#pragma once
// Draws poses of the object below a bound on its energy, and makes paths of them lower.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "base/check.hpp"
#include "base/portable.hpp"
#include "energymargin/limit.hpp"
#include "quasistatic/landscape.hpp"
#include "search/ompl_random.hpp"

namespace energymargin::quasistatic {

class PoseSampler {
 public:
  //! A draw that reaches the limit ends without a result.
  PoseSampler(Landscape& landscape, std::uint64_t seed, const Limit& limit) : landscape_(landscape), limit_(limit) {
    rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
  }

  //! Finds the box around the start to draw from, of half edge `reach` or else large enough for a fair share of its
  //! free poses to be outside. Gives these, settled; none at the limit. Throws std::invalid_argument if none is found.
  std::optional<std::vector<Pose>> find_box(const std::optional<double>& reach) {
    const int boxes = reach ? 1 : most_boxes;
    std::vector<Pose> best;
    double best_reach = 0.0, best_share = 0.0;
    reach_ = reach.value_or(2.0 * landscape_.radius());
    for (int i = 0; i < boxes && best_share < fair_share && !limit_.reached(); ++i, reach_ *= 2.0) {
      std::vector<Pose> outside = draw_outside(reach ? poses_in_given_box : poses_in_box);
      const double share = static_cast<double>(outside.size()) / poses_in_box;
      if (share < least_growth * best_share + 1.0 / poses_in_box) continue;
      best_share = share;
      best_reach = reach_;
      best = std::move(outside);
    }
    if (limit_.reached()) return std::nullopt;
    if (best_share == 0.0) {
      reject("reach", reach ? text(*reach) : "not given, and nothing is found up to " + text(reach_),
             "one in which poses of the object outside of its capture set are free");
    }
    reach_ = best_reach;
    may_grow_ = !reach;
    return best;
  }

  //! Half the edge of that box [m].
  double reach() const { return reach_; }

  //! An allowed pose with an energy below `bound` [J], sometimes near `known` ones; none if all tries were in vain.
  std::optional<Pose> draw(double bound, Side side, const std::vector<Pose>& known = {}) {
    for (int i = 0; i < most_tries && !limit_.reached(); ++i) {
      Pose pose = rng_.uniform01() < local_share ? draw_along_axis(known) : draw_in_box(bound);
      if (landscape_.energy(pose) >= bound) continue;
      if (side != Side::any && landscape_.outside(pose) != (side == Side::outside)) continue;
      if (!landscape_.allowed(pose)) continue;
      return side == Side::outside ? landscape_.settle(pose, reach_, true) : pose;
    }
    return std::nullopt;
  }

  //! A pose nearby: as far as about `scale` [m] away.
  Pose draw_near(const Pose& pose, double scale) {
    Pose sample = pose;
    for (int axis = 0; axis < 3; ++axis) {
      if (landscape_.sliding()[axis] != 0.0) sample.position[axis] += rng_.gaussian(0.0, scale);
    }
    const double turn = scale / landscape_.radius();
    if (landscape_.turning() == Turning::about_axis) {
      sample.orientation = portable::turn(rng_.gaussian(0.0, turn), landscape_.axis()) * sample.orientation;
    } else if (landscape_.turning() == Turning::all) {
      Vector3 by;
      for (double& angle : by)
        angle = rng_.gaussian(0.0, turn);  // one after the other: compilers order arguments freely
      sample.orientation = portable::turn(by.norm(), by.normalized()) * sample.orientation;
    }
    return sample;
  }

  //! A whole number below `end`, a small one rather than a large one.
  std::size_t draw_index(std::size_t end) {
    const double share = rng_.uniform01();
    return static_cast<std::size_t>(share * share * static_cast<double>(end));
  }

 private:
  static constexpr int most_tries = 200;
  // Shares of the draws.
  static constexpr double local_share = 0.2;    // that set out from a known pose
  static constexpr double start_share = 0.5;    // of these, from the start
  static constexpr double larger_share = 0.1;   // of the others, from a box twice as large; of these, four times, ...
  static constexpr double upright_share = 0.5;  // whose orientation is nearer that of the start

  static constexpr double infinity = std::numeric_limits<double>::infinity();

  // Search for a box.
  static constexpr double fair_share = 0.25;  // of the poses in a box that is large enough are outside
  static constexpr int poses_in_box = 64;
  static constexpr int poses_in_given_box = 2000;
  static constexpr int most_boxes = 20;        // each twice as large as the one before
  static constexpr double least_growth = 1.5;  // of the share: that of orientations alone is the same in any box

  // At most as many as are a fair share.
  std::vector<Pose> draw_outside(int poses) {
    std::vector<Pose> outside;
    for (int i = 0; i < poses && outside.size() < fair_share * poses_in_box; ++i) {
      const std::optional<Pose> pose = draw(infinity, Side::any);
      if (pose && landscape_.outside(*pose)) outside.push_back(landscape_.settle(*pose, reach_, true));
    }
    return outside;
  }

  // Mostly in the box, and now and then in one twice, four times, ... as large.
  Pose draw_in_box(double bound) {
    Pose pose = landscape_.start();
    double reach = reach_;
    while (may_grow_ && rng_.uniform01() < larger_share) reach *= 2.0;
    for (int axis = 0; axis < 3; ++axis) {
      if (landscape_.sliding()[axis] == 0.0) continue;
      const double up = below_bound(axis, bound, reach);
      const bool falls_up = landscape_.potential().load()[axis] > 0.0;
      pose.position[axis] += falls_up ? rng_.uniformReal(-up, reach) : rng_.uniformReal(-reach, up);
    }
    pose.orientation = draw_orientation();
    return pose;
  }

  Quaternion draw_orientation() {
    const Quaternion& start = landscape_.start().orientation;
    const bool upright = rng_.uniform01() < upright_share;
    if (landscape_.turning() == Turning::none) return start;
    if (landscape_.turning() == Turning::about_axis) {
      const double most = pi * (upright ? rng_.uniform01() * rng_.uniform01() : 1.0);
      return portable::turn(rng_.uniformReal(-most, most), landscape_.axis()) * start;
    }
    const Quaternion sample = rng_.turn();
    return upright ? portable::slerp(start, rng_.uniform01() * rng_.uniform01(), sample) : sample;
  }

  // A slot, a well or a rail is narrow in all directions but one: so one number changes by much, and the others little.
  Pose draw_along_axis(const std::vector<Pose>& known) {
    if (landscape_.sliding().isZero(0.0)) return draw_in_box(infinity);
    const bool from_start = known.empty() || rng_.uniform01() < start_share;
    const Pose& from = from_start
                           ? landscape_.start()
                           : known[static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(known.size()) - 1))];
    Pose pose = draw_near(from, draw_log_uniform(0.03 * landscape_.size(), landscape_.size()));
    int axis = rng_.uniformInt(0, 2);
    while (landscape_.sliding()[axis] == 0.0) axis = (axis + 1) % 3;
    const double direction = rng_.uniformBool() ? 1.0 : -1.0;
    pose.position[axis] += direction * draw_log_uniform(landscape_.size(), 2.0 * reach_);
    return pose;
  }

  // Where gravity alone acts along an axis, what is above the bound is left out of the box.
  double below_bound(int axis, double bound, double reach) const {
    const Vector3& load = landscape_.potential().load();
    const bool alone =
        !landscape_.potential().has_springs() && std::abs(load[axis]) == load.norm() && load[axis] != 0.0;
    return alone ? std::min(reach, bound / std::abs(load[axis])) : reach;
  }

  double draw_log_uniform(double least, double most) { return least * portable::pow(most / least, rng_.uniform01()); }

  Landscape& landscape_;
  Draws rng_;
  Limit limit_;
  double reach_ = 0.0;
  bool may_grow_ = false;
};

//! Local search: a path with the same start and a barrier as low or lower, which ends where it leaves the capture set,
//! and takes no detours that do not pay. A planner finds which way leads out; how closely it passes a rim is luck.
Path relax(const Path& solution, Landscape& landscape, PoseSampler& sampler, int trials, const Limit& limit);

}  // namespace energymargin::quasistatic
