#pragma once
// Confidence intervals of a score, from a few trees.

#include <string>

#include "energymargin/metrics/capture.hpp"

namespace energymargin {

struct Interval {
  double low = 0.0;
  double high = 1.0;
};

//! A confidence interval for the score of infinitely many trees, from those of two or more, shape (trees,). It holds
//! Student's interval and Wilson's for a share, which reaches farther from 0 and 1. A tree that scores 0 or 1 cannot
//! see some nodes of the likelihood `resolution`; the interval is at least as wide as those.
Interval interval(const Eigen::VectorXd& scores, double resolution, double confidence = 0.95);

//! A confidence interval for the score of infinitely many trees of this size. `which`: "capture", "success",
//! "capture_any" or "success_any". Throws std::invalid_argument on another word, a set that the problem does not have,
//! a confidence that is not between 0 and 1, or a single tree.
Interval interval(const CaptureScore& score, const std::string& which = "capture", double confidence = 0.95);

}  // namespace energymargin
