#pragma once
// How well a few trees know a score.

#include <string>

#include "energymargin/metrics/capture.hpp"

namespace energymargin {

struct Interval {
  double low = 0.0;
  double high = 1.0;
};

//! Where the mean of ever more trees' scores lies, with a probability of `confidence`: Student's t, widened by what
//! trees that agree cannot see, of the size of `resolution`, and cut to 0..1. `scores` are those of two or more trees.
Interval interval(const Eigen::VectorXd& scores, double resolution, double confidence = 0.95);

//! Where the mean score of ever more trees of as many nodes lies, with a probability of `confidence`. `which`:
//! "capture", "success", "capture_any" or "success_any". Throws std::invalid_argument on another word, a set that the
//! problem does not have, a confidence that is not between 0 and 1, or a single tree.
Interval interval(const CaptureScore& score, const std::string& which = "capture", double confidence = 0.95);

}  // namespace energymargin
