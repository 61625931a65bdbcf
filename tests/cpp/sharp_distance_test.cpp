// Distances and penetration depths of all pairs of solids with sharp edges, proved apart from how they are found.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "physics/contacts/solid_pair.hpp"

namespace energymargin {
namespace {

using Real = long double;
using Vector = Eigen::Matrix<Real, 3, 1>;

Vector exact(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

// A solid without Bullet: corners with a disc across z or a ball around each, and the normals and edges that it has.
struct Solid {
  std::unique_ptr<btConvexShape> shape;
  std::vector<Vector> corners, normals, edges;  // in its own frame
  Real disc = 0.0L, ball = 0.0L;                // radii
  btTransform pose = btTransform::getIdentity();

  bool is_round() const { return disc > 0.0L || ball > 0.0L; }

  Vector in_world(const Vector& v) const {
    const btMatrix3x3& turn = pose.getBasis();
    return {exact(turn[0]).dot(v), exact(turn[1]).dot(v), exact(turn[2]).dot(v)};
  }
  Vector in_own_frame(const Vector& v) const {
    const btMatrix3x3& turn = pose.getBasis();
    return v.x() * exact(turn[0]) + v.y() * exact(turn[1]) + v.z() * exact(turn[2]);
  }

  // How far it reaches along a unit vector in the world.
  Real reach(const Vector& along) const {
    const Vector own = in_own_frame(along);
    Real most = corners.front().dot(own);
    for (const Vector& corner : corners) most = std::max(most, corner.dot(own));
    return exact(pose.getOrigin()).dot(along) + most + ball + disc * std::hypot(own.x(), own.y());
  }

  // How far a point of the world is outside of it, or of its faces, at most.
  Real outside(const btVector3& point) const {
    const Vector own = in_own_frame(exact(point) - exact(pose.getOrigin()));
    if (ball > 0.0L) {
      const Real half = corners.front().z();
      return (own - Vector(0.0L, 0.0L, std::clamp(own.z(), -std::abs(half), std::abs(half)))).norm() - ball;
    }
    Real most = disc > 0.0L ? std::hypot(own.x(), own.y()) - disc : -1.0L;
    for (const Vector& normal : normals) {
      Real offset = corners.front().dot(normal);
      for (const Vector& corner : corners) offset = std::max(offset, corner.dot(normal));
      most = std::max(most, own.dot(normal) - offset);
    }
    return most;
  }
};

// Solids of 2 to 20 cm.
class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}

  double even(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  int whole(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }

  btVector3 direction() {
    std::normal_distribution<double> normal;
    return btVector3(normal(random_), normal(random_), normal(random_)).normalized();
  }

  Solid solid(int kind) {
    Solid made;
    const double radius = even(0.01, 0.1), half = even(0.01, 0.1);
    const Vector x(1.0L, 0.0L, 0.0L), y(0.0L, 1.0L, 0.0L), z(0.0L, 0.0L, 1.0L);
    if (kind == 0) {
      const btVector3 size(radius, even(0.01, 0.1), half);
      made.shape = std::make_unique<btBoxShape>(size);
      for (int i = 0; i < 8; ++i) {
        made.corners.emplace_back(i & 1 ? size.x() : -size.x(), i & 2 ? size.y() : -size.y(),
                                  i & 4 ? size.z() : -size.z());
      }
      made.normals = {x, y, z, -x, -y, -z};
      made.edges = {x, y, z};
    } else if (kind == 1) {
      made.shape = std::make_unique<btCylinderShapeZ>(btVector3(radius, radius, half));
      made.corners = {half * z, -half * z};
      made.normals = {z, -z};
      made.edges = {z};
      made.disc = radius;
    } else if (kind == 2) {
      made.shape = std::make_unique<btCapsuleShapeZ>(radius, 2.0 * half);
      made.corners = {half * z, -half * z};
      made.edges = {z};
      made.ball = radius;
    } else if (kind == 3) {
      made.shape = std::make_unique<btSphereShape>(radius);
      made.corners = {0.0L * z};
      made.ball = radius;
    } else {
      std::vector<Vector3> points(static_cast<std::size_t>(4 + whole(8)));
      for (Vector3& point : points) point = Vector3(even(-radius, radius), even(-radius, radius), even(-half, half));
      if (kind == 5) {  // a prism, of parallel faces and edges
        points.clear();
        for (int i = 0; i < 12; ++i) {
          const double angle = SIMD_2_PI * (i / 2) / 6.0;
          points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), i % 2 ? half : -half);
        }
      }
      made.shape = std::make_unique<HullShape>(points, 0.0005);
      for (const Vector3& point : points) made.corners.push_back(point.cast<Real>());
      add_faces(made);
    }
    if (kind < 2) made.shape->setMargin(0.0005);
    return made;
  }

 private:
  // By every three corners that have all others on one side.
  static void add_faces(Solid& solid) {
    const std::vector<Vector>& at = solid.corners;
    for (std::size_t i = 0; i < at.size(); ++i) {
      for (std::size_t j = 0; j < at.size(); ++j) {
        for (std::size_t k = 0; k < at.size(); ++k) {
          if (i == j || j == k || i == k) continue;
          const Vector normal = (at[j] - at[i]).cross(at[k] - at[i]).normalized();
          const auto is_behind = [&](const Vector& corner) { return normal.dot(corner - at[i]) <= 1e-12L; };
          if (!normal.allFinite() || !std::all_of(at.begin(), at.end(), is_behind)) continue;
          solid.normals.push_back(normal);
          solid.edges.push_back((at[j] - at[i]).normalized());
        }
      }
    }
  }

  std::mt19937_64 random_;
};

// How far two solids are apart along a unit vector from b to a.
Real gap(const Solid& a, const Solid& b, const Vector& normal) { return -a.reach(-normal) - b.reach(normal); }

// The least way that parts two solids that overlap: that of the separating-axis theorem, which is exact where neither
// is round, and else the best of many directions, each climbed.
Real penetration_depth(const Solid& a, const Solid& b, Draw& draw) {
  std::vector<std::pair<Real, Vector>> axes;
  const auto add = [&](const Vector& axis) { axes.emplace_back(gap(a, b, axis), axis); };
  for (const Vector& normal : a.normals) add(-a.in_world(normal));
  for (const Vector& normal : b.normals) add(b.in_world(normal));
  for (const Vector& along : a.edges) {
    for (const Vector& other : b.edges) {
      const Vector across = a.in_world(along).cross(b.in_world(other));
      if (across.norm() < 1e-9L) continue;
      add(across.normalized());
      add(-across.normalized());
    }
  }
  const auto nearer = [](const auto& one, const auto& other) { return one.first > other.first; };
  if (a.is_round() || b.is_round()) {
    for (int i = 0; i < 1000; ++i) add(exact(draw.direction()));
    std::sort(axes.begin(), axes.end(), nearer);
    axes.resize(6);
    for (auto& [most, axis] : axes) {
      for (Real step = 0.1L; step > 1e-11L; step *= 0.6L) {
        for (int i = 0; i < 12; ++i) {
          const Vector next = (axis + step * exact(draw.direction())).normalized();
          const Real there = gap(a, b, next);
          if (there <= most) continue;
          most = there;
          axis = next;
        }
      }
    }
  }
  return -std::max_element(axes.begin(), axes.end(), [](const auto& one, const auto& other) {
            return one.first < other.first;
          })->first;
}

btQuaternion some_turn(Draw& draw) {
  const btQuaternion any(draw.direction(), draw.even(0.0, SIMD_PI));
  const btQuaternion quarter(btVector3(draw.whole(2), draw.whole(2), 1.0).normalized(), SIMD_HALF_PI * draw.whole(4));
  switch (draw.whole(4)) {
    case 0:
      return quarter;
    case 1:
      return btQuaternion(draw.direction(), std::pow(10.0, draw.even(-10.0, -2.0))) * quarter;
    case 2:
      return btQuaternion(btVector3(1.0, 0.0, 0.0), SIMD_PI / 4.0) * quarter;
    default:
      return any;
  }
}

constexpr double everywhere = 1e9;

ClosestPoints closest(const Solid& a, const Solid& b) {
  return sharp_closest(*a.shape, a.pose, *b.shape, b.pose, everywhere).value();
}

std::string names(const Solid& a, const Solid& b, double distance) {
  return std::string(a.shape->getName()) + ", " + b.shape->getName() + " at " + std::to_string(distance);
}

// Calls `visit` with pairs of all kinds, whose corners, edges and faces meet: apart, touching and overlapping by so
// much.
template <typename Visit>
void for_pairs(int of_each, unsigned seed, const Visit& visit) {
  Draw draw(seed);
  constexpr int kinds = 6;
  for (int pair = 0; pair < kinds * kinds; ++pair) {
    for (int i = 0; i < of_each; ++i) {
      Solid a = draw.solid(pair / kinds), b = draw.solid(pair % kinds);
      const btQuaternion frame =
          draw.whole(2) ? btQuaternion(draw.direction(), draw.even(0.0, 3.0)) : btQuaternion::getIdentity();
      b.pose = btTransform(frame, {0.1, 0.2, -0.3});
      btVector3 aside = draw.direction();
      if (draw.whole(2)) aside[draw.whole(3)] = 0.0;
      a.pose = b.pose * btTransform(some_turn(draw), 0.5 * aside);
      const ClosestPoints apart = closest(a, b);
      for (const double distance : {1e-2, 1e-4, 1e-6, 1e-9, 0.0, -1e-9, -1e-6, -1e-4, -2e-3, -1e-2}) {
        const btTransform before = a.pose;
        a.pose.getOrigin() += apart.normal * (distance - apart.distance);
        visit(a, b, distance, draw);
        a.pose = before;
      }
    }
  }
}

// Proved from both sides: a plane across the normal is between the solids, so they are no nearer; each has one of the
// points, so they are no farther.
TEST(SharpDistance, OfSolidsThatAreApartIsTheGapAlongItsNormalAndThatOfItsPoints) {
  for_pairs(30, 1, [&](const Solid& a, const Solid& b, double distance, Draw&) {
    if (distance <= 0.0) return;
    const ClosestPoints found = closest(a, b);
    Real error = std::abs(found.distance - distance);
    if (distance > 1e-8) {  // nearer, the direction is not known
      error = std::max(error, std::abs(gap(a, b, exact(found.normal).normalized()) - found.distance));
      error = std::max(error, b.outside(found.on_b));
      error = std::max(error, a.outside(found.on_b + found.normal * found.distance));
    }
    EXPECT_LT(error, 1e-8L) << names(a, b, distance);
  });
}

// They part along the normal by that way, and along no other axis that was looked at by less. EPA's error is of second
// order where both are curved.
TEST(SharpDistance, OfSolidsThatOverlapIsTheLeastWayThatPartsThem) {
  for_pairs(8, 2, [&](const Solid& a, const Solid& b, double distance, Draw& draw) {
    if (distance > 0.0) return;
    const ClosestPoints found = closest(a, b);
    const Real longer = -found.distance - penetration_depth(a, b, draw);
    const Real along = distance < -1e-8 ? gap(a, b, exact(found.normal).normalized()) - found.distance : 0.0L;
    const bool curved = a.disc > 0.0L && b.disc > 0.0L;
    EXPECT_LT(std::max(longer, std::abs(along)), curved ? 5e-6L : 5e-8L) << names(a, b, distance);
  });
}

}  // namespace
}  // namespace energymargin
