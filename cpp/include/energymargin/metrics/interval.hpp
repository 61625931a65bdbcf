#pragma once
// How well a few trees know a score.

#include <string>

#include "energymargin/metrics/capture.hpp"

namespace energymargin {

struct Interval {
  double low = 0.0;
  double high = 1.0;
};

//! Where the mean of ever more trees' scores lies, with a probability of `confidence`: Student's interval, and with it
//! that of Wilson for a share, which reaches farther from 0 and 1; where a tree scores 0 or 1 it is as wide as what
//! such a tree cannot see, some nodes of the likelihood `resolution`. `scores` are those of two or more trees.
Interval interval(const Eigen::VectorXd& scores, double resolution, double confidence = 0.95);

//! Where the mean score of ever more trees of as many nodes lies, with a probability of `confidence`. `which`:
//! "capture", "success", "capture_any" or "success_any". Throws std::invalid_argument on another word, a set that the
//! problem does not have, a confidence that is not between 0 and 1, or a single tree.
Interval interval(const CaptureScore& score, const std::string& which = "capture", double confidence = 0.95);

}  // namespace energymargin
