#include "energymargin/metrics/interval.hpp"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <utility>

#include "../check.hpp"

namespace energymargin {
namespace {

const Eigen::VectorXd& by_tree(const CaptureScore& score, const std::string& which) {
  const std::pair<const char*, const Eigen::VectorXd&> all[] = {{"capture", score.capture_by_tree},
                                                                {"success", score.success_by_tree},
                                                                {"capture_any", score.capture_any_by_tree},
                                                                {"success_any", score.success_any_by_tree}};
  for (const auto& [name, values] : all) {
    if (which != name) continue;
    if (values.size() == 0) reject("which", "'" + which + "'", "a set that the problem has");
    return values;
  }
  reject("which", "'" + which + "'", "'capture', 'success', 'capture_any' or 'success_any'");
}

}  // namespace

Interval interval(const Eigen::VectorXd& scores, double resolution, double confidence) {
  if (!(confidence > 0.0 && confidence < 1.0)) reject("confidence", text(confidence), "a number between 0 and 1");
  if (scores.size() < 2) reject("trees", "1", "two or more for an interval");
  const double n = static_cast<double>(scores.size());
  const double mean = scores.mean();
  const double error = std::sqrt((scores.array() - mean).square().sum() / (n * (n - 1.0)));
  const double scatter = error * quantile(boost::math::students_t(n - 1.0), 0.5 + 0.5 * confidence);
  // Rule of three: what none of n trees has seen happens in at most a share of -log(1 - confidence) / n of them, and
  // then it weighs about as much as one node.
  const double unseen = -std::log(1.0 - confidence) / n * resolution;
  const double half = std::hypot(scatter, unseen);
  return {std::max(mean - half, 0.0), std::min(mean + half, 1.0)};
}

Interval interval(const CaptureScore& score, const std::string& which, double confidence) {
  return interval(by_tree(score, which), score.resolution, confidence);
}

}  // namespace energymargin
