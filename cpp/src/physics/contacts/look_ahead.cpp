// Contacts of bodies that are apart, and come nearer in a substep: along which normal, and whether at all.

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/contacts/collision_pairs.hpp"

namespace energymargin {
namespace {

// Points that are nearer than this share of a contact's reach touch; so do those that meet within this share of a way.
constexpr double bearing = 1e-3, meeting = 1e-3;

constexpr double same_normal = 1.0 - 1e-12;  // cosine

// Places on a way at which contacts are looked for.
constexpr int most_looks = 8;

// The way of a point of a body from a share of it on, as long as the whole way is [m].
btVector3 way_of(const Sweep& sweep, double share, const btVector3& origin, const btVector3& point) {
  const btVector3 linear = sweep.screw && share > 0.0 ? sweep.turned(sweep.linear, share) : sweep.linear;
  return linear + sweep.angular.cross(point - origin);
}

}  // namespace

CollisionPairs::Touch CollisionPairs::first_touch(const std::vector<FacePoint>& points, const btVector3& normal,
                                                  const Ways& ways, double share, double nearest) {
  Touch first{std::numeric_limits<double>::infinity(), 0.0};
  const btVector3 of_a = ways.a.at(share).getOrigin(), of_b = ways.b.at(share).getOrigin();
  for (const FacePoint& point : points) {
    if (point.distance <= nearest) continue;
    const btVector3 on_a = point.on_b + normal * point.distance;
    const double closing = normal.dot(way_of(ways.b, share, of_b, point.on_b) - way_of(ways.a, share, of_a, on_a));
    if (!(closing > 0.0)) continue;
    const double at = share + std::max(0.0, point.distance) / closing;
    if (at < first.share) first = {at, closing};
  }
  return first;
}

// Finds the contacts of two pieces, where they are nearest if they are apart: at the share of their ways that is
// returned. A gap along a normal that turns closes later than it seems, or not at all: Newton's method on the distance,
// which is convex on straight ways, comes to the touch from before it.
double CollisionPairs::look_ahead(CollisionPair& pair, std::size_t k, const Ways& ways, btVector3& normal) {
  const std::vector<FacePoint>& points = points_of(pair, k, ways.a.start, ways.b.start, normal);
  const double nearest = bearing * pair.near.depth;
  Touch touch = first_touch(points, normal, ways, 0.0, nearest);
  if (!(touch.share < 1.0)) return 0.0;
  const bool bears =
      std::any_of(points.begin(), points.end(), [&](const FacePoint& point) { return point.distance <= nearest; });
  const btVector3 now = normal;
  double share = 0.0;
  if (!bears && !pair.solids.empty()) {
    for (int i = 0; i < most_looks && touch.share < 1.0 && touch.share - share > meeting; ++i) {
      share = touch.share;
      points_of(pair, k, ways.a.at(share), ways.b.at(share), normal);
      touch = first_touch(points, normal, ways, share, -BT_LARGE_FLOAT);
    }
    if (share > 0.0 && normal.dot(now) > same_normal) {
      share = 0.0;
      points_of(pair, k, ways.a.start, ways.b.start, normal);
    }
  }
  const bool fast = touch.share < 1.0 && touch.closing > restitution_speed * duration_;
  if (pair.bounces && fast && touch.share * duration_ > meeting * scene_.stepping().step) {
    until_touch_ = std::min(until_touch_, touch.share * duration_);
  }
  return share;
}

}  // namespace energymargin
