#include "physics/contacts/patches.hpp"

#include <algorithm>
#include <cmath>

#include "base/portable.hpp"

namespace energymargin {
namespace {

struct Place {
  double x, y;  // in the plane of contact [m]
};

using Outline = std::vector<Place>;

constexpr double least_area = 1e-9;  // an area by the square of its length, from which on it is a line

double cross(const Place& from, const Place& to, const Place& place) {
  return (to.x - from.x) * (place.y - from.y) - (to.y - from.y) * (place.x - from.x);
}

// The corners of the convex hull in counter-clockwise order (Andrew 1979).
Outline outline_of(Outline places) {
  std::sort(places.begin(), places.end(),
            [](const Place& a, const Place& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  Outline hull;
  const auto add = [&hull](const Place& place, std::size_t first) {
    while (hull.size() >= first + 2 && cross(hull[hull.size() - 2], hull.back(), place) <= 0.0) hull.pop_back();
    hull.push_back(place);
  };
  for (const Place& place : places) add(place, 0);
  const std::size_t lower = hull.size() - 1;
  for (auto place = places.rbegin() + 1; place != places.rend(); ++place) add(*place, lower);
  hull.pop_back();
  return hull;
}

// Calls `visit(from, to)` with the edges.
template <typename Visit>
void for_each_edge(const Outline& outline, const Visit& visit) {
  for (std::size_t i = 0; i < outline.size(); ++i) visit(outline[i], outline[(i + 1) % outline.size()]);
}

struct Patch {
  Place middle;
  double lever;  // mean distance from the middle [m]
};

Patch patch_of_line(const Outline& places) {
  const auto [low, high] = std::minmax_element(
      places.begin(), places.end(), [](const Place& a, const Place& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  const double length = std::hypot(high->x - low->x, high->y - low->y);
  return {{0.5 * (low->x + high->x), 0.5 * (low->y + high->y)}, 0.25 * length};
}

// The integral of the distance over an area is a third of that of distance times height over its outline (Gauss).
Patch patch_of(const Outline& places) {
  const Outline outline = outline_of(places);
  const Place& first = outline.front();
  double area = 0.0, size = 0.0, x = 0.0, y = 0.0;
  for_each_edge(outline, [&](const Place& from, const Place& to) {
    const double half = 0.5 * cross(first, from, to);
    area += half;
    x += half * (first.x + from.x + to.x) / 3.0;
    y += half * (first.y + from.y + to.y) / 3.0;
    size = std::max(size, std::hypot(to.x - from.x, to.y - from.y));
  });
  if (!(area > least_area * size * size)) return patch_of_line(places);
  const Place middle{x / area, y / area};
  double sum = 0.0;
  for_each_edge(outline, [&](const Place& from, const Place& to) {
    const double length = std::hypot(to.x - from.x, to.y - from.y), height = cross(middle, from, to) / length;
    if (!(length > 0.0 && height > 0.0)) return;
    const auto along = [&](const Place& place) {
      return ((place.x - middle.x) * (to.x - from.x) + (place.y - middle.y) * (to.y - from.y)) / length;
    };
    const auto integral = [height](double s) {
      return 0.5 * (s * std::hypot(height, s) + height * height * portable::asinh(s / height));
    };
    sum += height / 3.0 * (integral(along(to)) - integral(along(from)));
  });
  return {middle, sum / area};
}

}  // namespace

void spread(std::vector<FacePoint>& points, const btVector3& normal, double radius) {
  if (points.empty()) return;
  btVector3 x, y;
  btPlaneSpace1(normal, x, y);
  const btVector3 origin = points.front().on_b;
  double height = 0.0;
  Outline places;
  for (const FacePoint& point : points) {
    const btVector3 from = point.on_b - origin;
    places.push_back({x.dot(from), y.dot(from)});
    height += normal.dot(from) / static_cast<double>(points.size());
  }
  const Patch patch = places.size() < 3 ? patch_of_line(places) : patch_of(places);
  const btVector3 middle = origin + x * patch.middle.x + y * patch.middle.y + normal * height;
  // Those of a round face rub inside of their rim already.
  const bool is_round = points.front().grip != points.front().on_b;
  double lever = is_round ? 0.0 : patch.lever;
  for (const FacePoint& point : points) {
    if (is_round) lever += (point.grip - middle).length() / static_cast<double>(points.size());
  }
  for (FacePoint& point : points) {
    point.grip = middle;
    point.lever = std::max(lever, grip_share * radius);
  }
}

}  // namespace energymargin
