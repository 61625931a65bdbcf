#pragma once
// Confidence intervals of a score, from a few trees.

#include <string>

#include "energymargin/metrics/capture.hpp"

namespace energymargin {

struct Interval {
  double low = 0.0;
  double high = 1.0;
};

//! A confidence interval for the score of infinitely many trees, from those of two or more, shape (trees,): it holds
//! Student's interval, Wilson's for a share, and what a tree that scores 0 or 1 cannot see, of likelihood `resolution`.
Interval interval(const Eigen::VectorXd& scores, double resolution, double confidence = 0.95);

//! The interval of one of `set_scores`. Throws std::invalid_argument on a bad word or confidence, or a single tree.
Interval interval(const CaptureScore& score, const std::string& which = "capture", double confidence = 0.95);

}  // namespace energymargin
