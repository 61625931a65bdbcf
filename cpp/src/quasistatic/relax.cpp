#include <algorithm>
#include <cmath>

#include "quasistatic/pose_sampler.hpp"

namespace energymargin::quasistatic {
namespace {

constexpr double closest = 0.02;       // two poses of a path, in smallest half extents
constexpr double first_scale = 0.3;    // of a trial's move, in radii of the object
constexpr double least_scale = 1e-4;   // at which the search is over, in smallest half extents
constexpr double first_spacing = 0.5;  // of the poses that are moved, in radii
constexpr double least_spacing = 0.1;
constexpr int trials_per_fall = 8;     // every such trial lets the top fall down to what is below
constexpr double after_success = 1.5;  // the scale's factors: it stays where one trial in five is a success
constexpr double after_failure = 0.9;
constexpr int halvings = 40;  // of the step on which a path leaves the capture set

// Inserts a pose where a path is highest, and returns its index.
std::size_t insert_top(Path& path, const Landscape::Barrier& highest) {
  const auto next = static_cast<std::ptrdiff_t>(highest.edge) + 1;
  path.insert(path.begin() + next, interpolate(path[highest.edge], path[highest.edge + 1], highest.at));
  return highest.edge + 1;
}

// Index of a path's highest pose; inserts one unless there is one nearby.
std::size_t find_top(Path& path, const Landscape::Barrier& highest, const Landscape& landscape) {
  const double whole = landscape.length(path[highest.edge], path[highest.edge + 1]);
  const double near = std::min(highest.at, 1.0 - highest.at) * whole;
  return near < closest * landscape.size() ? highest.edge + (highest.at > 0.5 ? 1 : 0) : insert_top(path, highest);
}

// A share of a move from one pose to another, on from a third one.
Pose move(const Pose& pose, const Pose& from, const Pose& to, double share) {
  const Quaternion turn = portable::slerp(Quaternion::Identity(), share, to.orientation * from.orientation.conjugate());
  return {pose.position + share * (to.position - from.position), (turn * pose.orientation).normalized()};
}

// Whether all ways of a path are free, from the pose that moved outwards: what is in the way is near it.
bool passes_from(std::size_t index, const Path& path, Landscape& landscape) {
  for (std::size_t i = index; i > 0; --i) {
    if (!landscape.passes(path[i - 1], path[i])) return false;
  }
  for (std::size_t i = index; i + 1 < path.size(); ++i) {
    if (!landscape.passes(path[i], path[i + 1])) return false;
  }
  return true;
}

// Bends a path so that one pose gets to `to`, and up to `width` - 1 poses on each side of it go along with a part of
// the move, if the barrier is lower then or, at several tops, as high.
bool bend(Path& path, std::size_t index, std::size_t width, const Pose& to, double highest, Landscape& landscape) {
  if (landscape.energy(to) >= landscape.energy(path[index])) return false;
  const std::size_t first = index > width ? index - width : 0;
  const std::size_t last = std::min(index + width, path.size() - 1);
  Path part(path.begin() + static_cast<std::ptrdiff_t>(first), path.begin() + static_cast<std::ptrdiff_t>(last) + 1);
  for (std::size_t i = std::max<std::size_t>(first, 1); i <= last; ++i) {
    const std::size_t steps = i > index ? i - index : index - i;
    const double share = 1.0 - static_cast<double>(steps) / static_cast<double>(width);
    if (share > 0.0) part[i - first] = move(path[i], path[index], to, share);
  }
  if (last + 1 == path.size() && !landscape.outside(part.back())) return false;
  for (std::size_t i = 0; i + 1 < part.size(); ++i) {
    if (landscape.peak(part[i], part[i + 1]).energy > highest) return false;
  }
  if (!passes_from(index - first, part, landscape)) return false;
  std::copy(part.begin(), part.end(), path.begin() + static_cast<std::ptrdiff_t>(first));
  return true;
}

// The first pose outside, between one in the capture set and one outside.
Pose find_exit(Pose inside, Pose outside, Landscape& landscape) {
  for (int i = 0; i < halvings; ++i) {
    const Pose middle = interpolate(inside, outside, 0.5);
    (landscape.outside(middle) ? outside : inside) = middle;
  }
  return outside;
}

// Every pose as low as it gets without turning; the last one as low as it gets outside.
Path fall(Path path, double reach, Landscape& landscape) {
  for (std::size_t i = 1; i < path.size(); ++i) path[i] = landscape.settle(path[i], reach, i + 1 == path.size());
  return path;
}

Path without_turns(Path path) {
  for (Pose& pose : path) pose.orientation = path.front().orientation;
  return path;
}

// The path up to where it leaves the capture set.
Path cut(const Path& path, Landscape& landscape) {
  Path inside{path.front()};
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Path way = landscape.divide({path[i], path[i + 1]});
    const auto outside = [&](const Pose& pose) { return landscape.outside(pose); };
    const auto first = std::find_if(way.begin() + 1, way.end(), outside);
    if (first != way.end()) {
      inside.push_back(find_exit(*(first - 1), *first, landscape));
      break;
    }
    inside.push_back(path[i + 1]);
  }
  return inside;
}

// The path without the poses that it can do without: its barrier is no higher.
Path straighten(const Path& path, Landscape& landscape) {
  const double highest = landscape.barrier(path).energy;
  Path straight{path.front()};
  for (std::size_t i = 1; i < path.size(); ++i) {
    const bool needed = i + 1 == path.size() || landscape.peak(straight.back(), path[i + 1]).energy > highest ||
                        !landscape.passes(straight.back(), path[i + 1]);
    if (needed) straight.push_back(path[i]);
  }
  return straight;
}

// What sliding along a support would be, without turns if that leads out; `path` itself if nothing simpler does. No
// pose is farther than `reach` [m] from the start along an axis of the world.
Path simplify(const Path& path, double reach, Landscape& landscape) {
  for (const Path& simple :
       {fall(without_turns(path), reach, landscape), fall(path, reach, landscape), without_turns(path)}) {
    if (landscape.barrier(simple).energy <= landscape.barrier(path).energy && passes_from(0, simple, landscape) &&
        landscape.outside(simple.back())) {
      return simple;
    }
  }
  return path;
}

}  // namespace

Path relax(const Path& solution, Landscape& landscape, PoseSampler& sampler, int trials, const Limit& limit) {
  Path path = cut(straighten(simplify(cut(solution, landscape), sampler.reach(), landscape), landscape), landscape);
  double scale = 0.0;
  double spacing = first_spacing * landscape.radius();
  for (int i = 0; i < trials; ++i) {
    if (scale < least_scale * landscape.size()) {
      scale = first_scale * landscape.radius();
      path = landscape.divide(path, spacing);
      spacing = std::max(0.5 * spacing, least_spacing * landscape.radius());
    }
    if (limit.reached()) break;
    const Landscape::Barrier highest = landscape.barrier(path);
    if (highest.energy <= landscape.negligible()) break;
    const std::size_t index = find_top(path, highest, landscape);
    if (index == 0) break;
    const std::size_t width = 1 + sampler.draw_index(path.size());
    if (i % trials_per_fall == 0 &&
        bend(path, index, 1, landscape.settle(path[index], sampler.reach(), index + 1 == path.size()), highest.energy,
             landscape)) {
      continue;
    }
    const bool success = bend(path, index, width, sampler.draw_near(path[index], scale), highest.energy, landscape);
    scale *= success ? after_success : after_failure;
  }
  path = cut(straighten(cut(path, landscape), landscape), landscape);
  const Landscape::Barrier highest = landscape.barrier(path);
  if (highest.at > 0.0 && highest.at < 1.0) insert_top(path, highest);
  return path;
}

}  // namespace energymargin::quasistatic
