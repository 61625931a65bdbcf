#include "energymargin/search/relax.hpp"

#include <algorithm>

namespace energymargin::search {
namespace {

constexpr int most_trials = 400;
constexpr int halvings = 40;            // of the step on which a path leaves the capture set
constexpr double first_scale = 0.3;     // of a trial's move, in radii of the object
constexpr double least_scale = 1e-4;    // at which the search is over, in smallest half extents
constexpr double after_success = 1.5;   // the scale's factors: it stays where one trial in five is a success
constexpr double after_failure = 0.9;

// Leaves out what it can without a higher barrier.
Path straightened(const Path& path, Quasistatics& statics) {
  const double highest = barrier(path, statics).energy;
  Path straight{path.front()};
  for (std::size_t i = 0; i + 1 < path.size();) {
    std::size_t next = path.size() - 1;
    while (next > i + 1 &&
           (statics.peak(path[i], path[next]).energy > highest || !statics.passes(path[i], path[next]))) {
      --next;
    }
    straight.push_back(path[next]);
    i = next;
  }
  return straight;
}

// Index of a path's highest pose; one is put there if it lies on a way.
std::size_t top(Path& path, const Barrier& highest) {
  const std::size_t edge = highest.edge;
  if (highest.at == 0.0 || highest.at == 1.0) return edge + (highest.at == 1.0 ? 1 : 0);
  path.insert(path.begin() + static_cast<std::ptrdiff_t>(edge) + 1, between(path[edge], path[edge + 1], highest.at));
  return edge + 1;
}

// Moves one pose of a path, if that makes it lower and nothing higher than `highest`.
bool move(Path& path, std::size_t index, const Pose& to, double highest, Quasistatics& statics) {
  const bool last = index + 1 == path.size();
  if (statics.energy(to) >= statics.energy(path[index])) return false;
  if (last && !statics.outside(to)) return false;
  if (statics.peak(path[index - 1], to).energy > highest) return false;
  if (!last && statics.peak(to, path[index + 1]).energy > highest) return false;
  if (!statics.passes(path[index - 1], to) || (!last && !statics.passes(to, path[index + 1]))) return false;
  path[index] = to;
  return true;
}

}  // namespace

Barrier barrier(const Path& path, const Quasistatics& statics) {
  Barrier highest;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Quasistatics::Peak peak = statics.peak(path[i], path[i + 1]);
    if (peak.energy > highest.energy) highest = {peak.energy, i, peak.at};
  }
  return highest;
}

Path cut(const Path& path, Quasistatics& statics) {
  Path inside{path.front()};
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    Path way;
    statics.append_way(path[i], path[i + 1], way);
    const auto first = std::find_if(way.begin(), way.end(), [&](const Pose& pose) { return statics.outside(pose); });
    if (first == way.end()) {
      inside.push_back(path[i + 1]);
      continue;
    }
    Pose in = first == way.begin() ? path[i] : *(first - 1);
    Pose out = *first;
    for (int halving = 0; halving < halvings; ++halving) {
      const Pose middle = between(in, out, 0.5);
      (statics.outside(middle) ? out : in) = middle;
    }
    inside.push_back(out);
    break;
  }
  return inside;
}

Path relax(const Path& path, Quasistatics& statics, PoseSampler& sampler, const std::atomic<bool>* stop) {
  Path relaxed = cut(straightened(cut(path, statics), statics), statics);
  double scale = first_scale * statics.radius();
  for (int i = 0; i < most_trials && scale > least_scale * statics.size(); ++i) {
    if (stop != nullptr && stop->load()) break;
    const Barrier highest = barrier(relaxed, statics);
    if (highest.energy == 0.0) break;
    const std::size_t index = top(relaxed, highest);
    const bool moved = move(relaxed, index, sampler.near(relaxed[index], scale), highest.energy, statics);
    scale *= moved ? after_success : after_failure;
  }
  return straightened(cut(relaxed, statics), statics);
}

}  // namespace energymargin::search
