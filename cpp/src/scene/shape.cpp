#include "energymargin/shape.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/portable.hpp"
#include "scene/body_constants.hpp"
#include "scene/records.hpp"

namespace energymargin {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Mass properties from the inertia about the centre, along the axes of the shape's frame [kg m^2].
MassProperties principal(double volume, const Vector3& center, const Eigen::Matrix3d& inertia) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia);
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0.0) axes.col(0) = -axes.col(0);
  return {volume, center, solver.eigenvalues(), Quaternion(axes).normalized()};
}

// Mass properties of a solid that is round about its z axis: `across` and `along` are its principal moments [kg m^2].
MassProperties about_axis(double volume, double across, double along) {
  return {volume, Vector3::Zero(), {across, across, along}, Quaternion::Identity()};
}

double smallest_half_extent(const Plane&) { return infinity; }
double reach_from(const Plane&, const Vector3&) { return infinity; }
MassProperties mass_properties(const Plane&, double) { return {}; }

double smallest_half_extent(const Box& box) { return 0.5 * box.size.minCoeff(); }
double reach_from(const Box& box, const Vector3& point) { return (point.cwiseAbs() + 0.5 * box.size).norm(); }
MassProperties mass_properties(const Box& box, double mass) {
  const Vector3 squares = box.size.cwiseAbs2();
  return {box.size.prod(), Vector3::Zero(), mass / 12.0 * (Vector3::Constant(squares.sum()) - squares),
          Quaternion::Identity()};
}

double smallest_half_extent(const Sphere& sphere) { return sphere.radius; }
double reach_from(const Sphere& sphere, const Vector3& point) { return point.norm() + sphere.radius; }
MassProperties mass_properties(const Sphere& sphere, double mass) {
  const double r = sphere.radius;
  return about_axis(4.0 / 3.0 * pi * r * r * r, 0.4 * mass * r * r, 0.4 * mass * r * r);
}

double smallest_half_extent(const Cylinder& cylinder) { return std::min(cylinder.radius, 0.5 * cylinder.length); }
double reach_from(const Cylinder& cylinder, const Vector3& point) {
  return std::hypot(point.head<2>().norm() + cylinder.radius, std::abs(point.z()) + 0.5 * cylinder.length);
}
MassProperties mass_properties(const Cylinder& cylinder, double mass) {
  const double r = cylinder.radius;
  const double h = cylinder.length;
  return about_axis(pi * r * r * h, mass * (3.0 * r * r + h * h) / 12.0, 0.5 * mass * r * r);
}

double smallest_half_extent(const Capsule& capsule) { return capsule.radius; }
double reach_from(const Capsule& capsule, const Vector3& point) {
  return std::hypot(point.head<2>().norm(), std::abs(point.z()) + 0.5 * capsule.length) + capsule.radius;
}
MassProperties mass_properties(const Capsule& capsule, double mass) {
  const double r = capsule.radius;
  const double h = capsule.length;
  const double tube = pi * r * r * h;
  const double ball = 4.0 / 3.0 * pi * r * r * r;
  const double tube_mass = mass * tube / (tube + ball);
  const double ball_mass = mass - tube_mass;
  // Each half ball: its own inertia about its centre of mass, 3/8 r from the flat side, moved to the middle.
  const double across =
      tube_mass * (3.0 * r * r + h * h) / 12.0 + ball_mass * (0.4 * r * r + 0.25 * h * h + 0.375 * h * r);
  return about_axis(tube + ball, across, 0.5 * tube_mass * r * r + 0.4 * ball_mass * r * r);
}

// Sums over tetrahedra between the origin and each triangle of the surface.
struct Moments {
  double volume = 0.0;
  Vector3 first = Vector3::Zero();                   // integral of x
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();  // integral of x x^T

  void add(const Vector3& a, const Vector3& b, const Vector3& c) {
    const double six_volumes = a.dot(b.cross(c));
    const Vector3 sum = a + b + c;
    volume += six_volumes / 6.0;
    first += six_volumes / 24.0 * sum;
    second += six_volumes / 120.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
  }
};

Moments moments(const std::vector<Vector3>& points) {
  Moments total;
  for (const auto& [a, b, c] : hull_faces(points)) total.add(points[a], points[b], points[c]);
  if (total.volume < 0.0) {
    total.volume = -total.volume;
    total.first = -total.first;
    total.second = -total.second;
  }
  return total;
}

MassProperties mass_properties(const ConvexHull& hull, double mass) {
  const Moments total = moments(hull.points);
  const double size = total.second.norm();
  if (!(total.volume > 1e-12 * portable::pow(size, 0.6))) return {};
  const double density = mass / total.volume;
  const Vector3 centre = total.first / total.volume;
  const Eigen::Matrix3d second = density * total.second - mass * centre * centre.transpose();
  return principal(total.volume, centre, second.trace() * Eigen::Matrix3d::Identity() - second);
}

// Along the principal axes: exact for a brick, close for the rest.
double smallest_half_extent(const ConvexHull& hull) {
  const Quaternion to_axes = mass_properties(hull, 1.0).axes.conjugate();
  Vector3 low = Vector3::Constant(infinity);
  Vector3 high = -low;
  for (const Vector3& point : hull.points) {
    low = low.cwiseMin(to_axes * point);
    high = high.cwiseMax(to_axes * point);
  }
  return 0.5 * (high - low).minCoeff();
}

double reach_from(const ConvexHull& hull, const Vector3& point) {
  double most = 0.0;
  for (const Vector3& corner : hull.points) most = std::max(most, (corner - point).norm());
  return most;
}

// The mass properties of a part in the compound's frame.
MassProperties part_properties(const Part& part, double mass) {
  MassProperties properties = std::visit([&](const auto& of) { return mass_properties(of, mass); }, part.shape);
  properties.center = part.pose.position + part.pose.orientation * properties.center;
  properties.axes = part.pose.orientation * properties.axes;
  return properties;
}

MassProperties sum_of_parts(const std::vector<Part>& compound, double mass) {
  std::vector<MassProperties> parts;  // of unit mass
  double volume = 0.0;
  Vector3 first = Vector3::Zero();
  for (const Part& solid : compound) {
    const MassProperties part = part_properties(solid, 1.0);
    volume += part.volume;
    first += part.volume * part.center;
    parts.push_back(part);
  }
  if (parts.empty()) return {};
  const Vector3 center = first / volume;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  for (const MassProperties& part : parts) {
    const Eigen::Matrix3d axes = part.axes.toRotationMatrix();
    const Vector3 arm = part.center - center;
    const double share = mass * part.volume / volume;
    inertia += share * (axes * part.moments.asDiagonal() * axes.transpose() +
                        arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose());
  }
  return principal(volume, center, inertia);
}

// The thickest part counts: a decomposed mesh has slivers, which say nothing of how deep is deep.
double smallest_half_extent(const Compound& compound) {
  double most = compound.parts.empty() ? infinity : 0.0;
  for (const Part& part : compound.parts) {
    most = std::max(most, std::visit([](const auto& of) { return smallest_half_extent(of); }, part.shape));
  }
  return most;
}

double reach_from(const Compound& compound, const Vector3& point) {
  double most = 0.0;
  for (const auto& [shape, pose] : compound.parts) {
    const Vector3 in_part = pose.orientation.conjugate() * (point - pose.position);
    most = std::max(most, std::visit([&](const auto& of) { return reach_from(of, in_part); }, shape));
  }
  return most;
}

MassProperties mass_properties(const Compound& compound, double mass) {
  if (!compound.solid && compound.parts.size() == 1) return part_properties(compound.parts.front(), mass);
  if (!compound.solid) return sum_of_parts(compound.parts, mass);
  MassProperties scaled = *compound.solid;
  scaled.moments *= mass;
  return scaled;
}

template <typename Simple>
void require_valid(const Simple& shape) {
  require_fields(shape);
}

void require_valid(const ConvexHull& hull) {
  if (hull.points.size() < 4) reject("points", std::to_string(hull.points.size()) + " points", "at least 4");
  for (const Vector3& point : hull.points) require_finite("points", point);
  if (!(mass_properties(hull, 1.0).volume > 0.0)) reject("points", "a flat set of points", "points that span a volume");
}

void require_valid(const Compound& compound) {
  for (std::size_t i = 0; i < compound.parts.size(); ++i) {
    at_place("parts[" + std::to_string(i) + "]: ", [&] {
      std::visit([](const auto& of) { require_valid(of); }, compound.parts[i].shape);
      require_fields(compound.parts[i]);
    });
  }
  require_fields(compound);
}

}  // namespace

void validate(const Shape& shape) {
  std::visit([](const auto& of) { require_valid(of); }, shape);
}

double smallest_half_extent(const Shape& shape) {
  return std::visit([](const auto& of) { return smallest_half_extent(of); }, shape);
}

double reach_from(const Shape& shape, const Vector3& point) {
  return std::visit([&](const auto& of) { return reach_from(of, point); }, shape);
}

MassProperties mass_properties(const Shape& shape, double mass) {
  return std::visit([&](const auto& of) { return mass_properties(of, mass); }, shape);
}

ConvexHull centered(const ConvexHull& hull) {
  validate(hull);
  const Vector3 center = mass_properties(hull, 1.0).center;
  ConvexHull moved = hull;
  for (Vector3& point : moved.points) point -= center;
  return moved;
}

}  // namespace energymargin
