#include "quasistatic/search_box.hpp"

#include <limits>
#include <utility>

#include "base/check.hpp"

namespace energymargin::quasistatic {
namespace {

struct Settings {
  double fair_share = 0.25;  // of the poses in a box that is large enough are outside
  int poses = 64;            // drawn in a box
  int poses_in_given_box = 2000;
  int most_boxes = 20;        // each twice as large as the one before
  double least_growth = 1.5;  // of the share: orientations alone have the same share in a box of any size
};
constexpr Settings settings{};

// At most as many as are a fair share.
std::vector<Pose> find_outside(Landscape& landscape, PoseSampler& sampler, double reach, int poses) {
  constexpr double bound = std::numeric_limits<double>::infinity();
  sampler.set_reach(reach, false);
  std::vector<Pose> outside;
  for (int i = 0; i < poses && outside.size() < settings.fair_share * settings.poses; ++i) {
    const std::optional<Pose> pose = sampler.draw(bound, Side::any);
    if (pose && landscape.outside(*pose)) outside.push_back(landscape.settle(*pose, reach, true));
  }
  return outside;
}

}  // namespace

std::optional<SearchBox> find_search_box(Landscape& landscape, PoseSampler& sampler, const std::optional<double>& reach,
                                         const Limit& limit) {
  const int boxes = reach ? 1 : settings.most_boxes;
  const int poses = reach ? settings.poses_in_given_box : settings.poses;
  SearchBox best;
  double best_share = 0.0;
  double next = reach.value_or(2.0 * landscape.radius());
  for (int i = 0; i < boxes && best_share < settings.fair_share && !limit.reached(); ++i, next *= 2.0) {
    std::vector<Pose> outside = find_outside(landscape, sampler, next, poses);
    const double share = static_cast<double>(outside.size()) / settings.poses;
    if (share < settings.least_growth * best_share + 1.0 / settings.poses) continue;
    best_share = share;
    best = {next, std::move(outside)};
  }
  if (limit.reached()) return std::nullopt;
  if (best_share == 0.0) {
    reject("reach", reach ? text(*reach) : "not given, and nothing is found up to " + text(next),
           "one in which poses of the object outside of its capture set are free");
  }
  return best;
}

}  // namespace energymargin::quasistatic
