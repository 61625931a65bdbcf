#include "quasistatic/relax.hpp"

#include <algorithm>
#include <cmath>

namespace energymargin::search {
namespace {

constexpr int halvings = 40;           // of the step on which a path leaves the capture set
constexpr double closest = 0.02;       // two poses of a path, in smallest half extents
constexpr double first_scale = 0.3;    // of a trial's move, in radii of the object
constexpr double least_scale = 1e-4;   // at which the search is over, in smallest half extents
constexpr double first_spacing = 0.5;  // of the poses that are moved, in radii
constexpr double least_spacing = 0.1;
constexpr int trials_per_fall = 8;     // every such trial lets the top fall down to what is below
constexpr double after_success = 1.5;  // the scale's factors: it stays where one trial in five is a success
constexpr double after_failure = 0.9;

// Leaves out what it can without a higher barrier.
Path straightened(const Path& path, Quasistatics& statics) {
  const double highest = barrier(path, statics).energy;
  Path straight{path.front()};
  for (std::size_t i = 1; i < path.size(); ++i) {
    const bool needed = i + 1 == path.size() || statics.peak(straight.back(), path[i + 1]).energy > highest ||
                        !statics.passes(straight.back(), path[i + 1]);
    if (needed) straight.push_back(path[i]);
  }
  return straight;
}

// Every pose as low as it gets without turning; the last one as low as it gets outside.
Path fallen(Path path, double reach, Quasistatics& statics) {
  for (std::size_t i = 1; i < path.size(); ++i) path[i] = statics.settled(path[i], reach, i + 1 == path.size());
  return path;
}

Path unturned(Path path) {
  for (Pose& pose : path) pose.orientation = path.front().orientation;
  return path;
}

bool leads_out(const Path& path, Quasistatics& statics) {
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    if (!statics.passes(path[i], path[i + 1])) return false;
  }
  return statics.outside(path.back());
}

// What sliding along a support would be, where that leads out.
Path simplest(const Path& path, double reach, Quasistatics& statics) {
  for (const Path& simple : {fallen(unturned(path), reach, statics), fallen(path, reach, statics), unturned(path)}) {
    if (barrier(simple, statics).energy <= barrier(path, statics).energy && leads_out(simple, statics)) return simple;
  }
  return path;
}

// The same path with poses at most `spacing` [m] apart, so that it can follow what it goes around.
Path divided(const Path& path, double spacing, const Quasistatics& statics) {
  Path fine{path.front()};
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const int count = std::max(1, static_cast<int>(std::ceil(statics.length(path[i], path[i + 1]) / spacing)));
    for (int j = 1; j < count; ++j) {
      fine.push_back(between(path[i], path[i + 1], static_cast<double>(j) / count));
    }
    fine.push_back(path[i + 1]);
  }
  return fine;
}

// Puts a pose where a path is highest, and returns its index.
std::size_t put(Path& path, const Barrier& highest) {
  const auto next = static_cast<std::ptrdiff_t>(highest.edge) + 1;
  path.insert(path.begin() + next, between(path[highest.edge], path[highest.edge + 1], highest.at));
  return highest.edge + 1;
}

// Index of a path's highest pose; one is put there unless there is one nearby.
std::size_t top(Path& path, const Barrier& highest, const Quasistatics& statics) {
  const double whole = statics.length(path[highest.edge], path[highest.edge + 1]);
  const double near = std::min(highest.at, 1.0 - highest.at) * whole;
  return near < closest * statics.size() ? highest.edge + (highest.at > 0.5 ? 1 : 0) : put(path, highest);
}

// A share of a move from one pose to another, on from a third one.
Pose moved(const Pose& pose, const Pose& from, const Pose& to, double share) {
  const Quaternion turn = Quaternion::Identity().slerp(share, to.orientation * from.orientation.conjugate());
  return {pose.position + share * (to.position - from.position), (turn * pose.orientation).normalized()};
}

// Bends a path so that one pose gets to `to`, and up to `width` - 1 poses on each side of it go along with a part of
// the move, if the barrier is lower then or, at several tops, as high.
bool bend(Path& path, std::size_t index, std::size_t width, const Pose& to, double highest, Quasistatics& statics) {
  if (statics.energy(to) >= statics.energy(path[index])) return false;
  const std::size_t first = index > width ? index - width : 0;
  const std::size_t last = std::min(index + width, path.size() - 1);
  Path bent(path.begin() + static_cast<std::ptrdiff_t>(first), path.begin() + static_cast<std::ptrdiff_t>(last) + 1);
  for (std::size_t i = std::max<std::size_t>(first, 1); i <= last; ++i) {
    const std::size_t steps = i > index ? i - index : index - i;
    const double share = 1.0 - static_cast<double>(steps) / static_cast<double>(width);
    if (share > 0.0) bent[i - first] = moved(path[i], path[index], to, share);
  }
  if (last + 1 == path.size() && !statics.outside(bent.back())) return false;
  for (std::size_t i = 0; i + 1 < bent.size(); ++i) {
    if (statics.peak(bent[i], bent[i + 1]).energy > highest) return false;
  }
  // From the top outwards: what is in the way is there, if anywhere.
  const std::size_t centre = index - first;
  for (std::size_t i = centre; i > 0; --i) {
    if (!statics.passes(bent[i - 1], bent[i])) return false;
  }
  for (std::size_t i = centre; i + 1 < bent.size(); ++i) {
    if (!statics.passes(bent[i], bent[i + 1])) return false;
  }
  std::copy(bent.begin(), bent.end(), path.begin() + static_cast<std::ptrdiff_t>(first));
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

Path relax(const Path& path, Quasistatics& statics, PoseSampler& sampler, int trials, const Limit& limit) {
  Path relaxed = cut(straightened(simplest(cut(path, statics), sampler.reach(), statics), statics), statics);
  double scale = 0.0;
  double spacing = first_spacing * statics.radius();
  for (int i = 0; i < trials; ++i) {
    if (scale < least_scale * statics.size()) {
      scale = first_scale * statics.radius();
      relaxed = divided(relaxed, spacing, statics);
      spacing = std::max(0.5 * spacing, least_spacing * statics.radius());
    }
    if (limit.reached()) break;
    const Barrier highest = barrier(relaxed, statics);
    if (highest.energy <= statics.negligible()) break;
    const std::size_t index = top(relaxed, highest, statics);
    if (index == 0) break;
    const std::size_t width = 1 + sampler.below(relaxed.size());
    if (i % trials_per_fall == 0 &&
        bend(relaxed, index, 1, statics.settled(relaxed[index], sampler.reach(), index + 1 == relaxed.size()),
             highest.energy, statics)) {
      continue;
    }
    const bool moved = bend(relaxed, index, width, sampler.near(relaxed[index], scale), highest.energy, statics);
    scale *= moved ? after_success : after_failure;
  }
  relaxed = cut(straightened(cut(relaxed, statics), statics), statics);
  const Barrier highest = barrier(relaxed, statics);
  if (highest.at > 0.0 && highest.at < 1.0) put(relaxed, highest);
  return relaxed;
}

}  // namespace energymargin::search
