#include "energymargin/metrics/interval.hpp"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

#include "base/check.hpp"
#include "base/words.hpp"

namespace energymargin {
namespace {

const SetScore& set_score(const CaptureScore& score, const std::string& which) {
  std::vector<std::string> names;
  for (const auto& [name, set] : set_scores(score)) {
    if (name == which && !set) reject("which", "'" + which + "'", "a set that the problem has");
    if (name == which) return *set;
    names.emplace_back(name);
  }
  reject("which", "'" + which + "'", alternatives(names));
}

// Nodes on the other side of a set come in clusters: one cluster weighs as much as so many heavy nodes.
constexpr double cluster = 2.0;

// Variance of the trees' scores in units of mean * (1 - mean), that of a share of single draws.
double dispersion(const Eigen::VectorXd& scores, double mean, double variance, double resolution) {
  const double single = mean * (1.0 - mean);
  const double measured = single > 0.0 ? variance / single : 0.0;
  const bool some_know_one_side = (scores.array() == 0.0 || scores.array() == 1.0).any();
  return some_know_one_side ? std::max(measured, cluster * resolution) : measured;
}

// Wilson's interval: the shares p with (mean - p)^2 <= width * p * (1 - p).
Interval share_interval(double mean, double width) {
  const double middle = mean + 0.5 * width;
  const double half = std::sqrt(width * (mean * (1.0 - mean) + 0.25 * width));
  return {(middle - half) / (1.0 + width), (middle + half) / (1.0 + width)};
}

}  // namespace

Interval interval(const Eigen::VectorXd& scores, double resolution, double confidence) {
  if (!(confidence > 0.0 && confidence < 1.0)) reject("confidence", text(confidence), "a number between 0 and 1");
  if (scores.size() < 2) reject("trees", std::to_string(scores.size()), "two or more for an interval");
  const double n = static_cast<double>(scores.size());
  const double mean = scores.mean();
  const double variance = (scores.array() - mean).square().sum() / (n - 1.0);
  const double t = quantile(boost::math::students_t(n - 1.0), 0.5 + 0.5 * confidence);
  const Interval shares = share_interval(mean, dispersion(scores, mean, variance, resolution) * t * t / n);
  const double half = t * std::sqrt(variance / n);
  return {std::max(std::min(shares.low, mean - half), 0.0), std::min(std::max(shares.high, mean + half), 1.0)};
}

Interval interval(const CaptureScore& score, const std::string& which, double confidence) {
  return interval(set_score(score, which).by_tree, score.resolution, confidence);
}

}  // namespace energymargin
