#include "quasistatic/simplify.hpp"

#include <algorithm>

#include "quasistatic/barrier.hpp"

namespace energymargin::quasistatic {
namespace {

constexpr int halvings = 40;  // of the step on which a path leaves the capture set

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

bool leads_out(const Path& path, Landscape& landscape) {
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    if (!landscape.passes(path[i], path[i + 1])) return false;
  }
  return landscape.outside(path.back());
}

}  // namespace

Path cut(const Path& path, Landscape& landscape) {
  Path inside{path.front()};
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    Path way;
    landscape.append_way(path[i], path[i + 1], way);
    const auto first = std::find_if(way.begin(), way.end(), [&](const Pose& pose) { return landscape.outside(pose); });
    if (first != way.end()) {
      inside.push_back(find_exit(first == way.begin() ? path[i] : *(first - 1), *first, landscape));
      break;
    }
    inside.push_back(path[i + 1]);
  }
  return inside;
}

Path straighten(const Path& path, Landscape& landscape) {
  const double highest = barrier(path, landscape).energy;
  Path straight{path.front()};
  for (std::size_t i = 1; i < path.size(); ++i) {
    const bool needed = i + 1 == path.size() || landscape.peak(straight.back(), path[i + 1]).energy > highest ||
                        !landscape.passes(straight.back(), path[i + 1]);
    if (needed) straight.push_back(path[i]);
  }
  return straight;
}

Path simplify(const Path& path, double reach, Landscape& landscape) {
  for (const Path& simple :
       {fall(without_turns(path), reach, landscape), fall(path, reach, landscape), without_turns(path)}) {
    if (barrier(simple, landscape).energy <= barrier(path, landscape).energy && leads_out(simple, landscape))
      return simple;
  }
  return path;
}

}  // namespace energymargin::quasistatic
