// Mass properties of solids.

#include <Eigen/Eigenvalues>
#include <cmath>

#include "base/angles.hpp"
#include "energymargin/shape.hpp"
#include "scene/hull_faces.hpp"

namespace energymargin {
namespace {

MassProperties about_axis(double volume, double across, double along) {
  return {volume, Vector3::Zero(), {across, across, along}, Quaternion::Identity()};
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

MassProperties diagonalized(double volume, const Vector3& center, const Eigen::Matrix3d& inertia) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia);
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0.0) axes.col(0) = -axes.col(0);
  return {volume, center, solver.eigenvalues(), Quaternion(axes).normalized()};
}

struct Measure {
  double mass;

  MassProperties operator()(const Plane&) const { return {}; }
  MassProperties operator()(const Box& box) const {
    const Vector3 squares = box.size.cwiseAbs2();
    return {box.size.prod(), Vector3::Zero(), mass / 12.0 * (Vector3::Constant(squares.sum()) - squares),
            Quaternion::Identity()};
  }
  MassProperties operator()(const Sphere& sphere) const {
    const double r = sphere.radius;
    return about_axis(4.0 / 3.0 * pi * r * r * r, 0.4 * mass * r * r, 0.4 * mass * r * r);
  }
  MassProperties operator()(const Cylinder& cylinder) const {
    const double r = cylinder.radius;
    const double h = cylinder.length;
    return about_axis(pi * r * r * h, mass * (3.0 * r * r + h * h) / 12.0, 0.5 * mass * r * r);
  }
  MassProperties operator()(const Capsule& capsule) const {
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
  MassProperties operator()(const ConvexHull& hull) const {
    const Moments total = moments(hull.points);
    const double size = total.second.norm();
    if (!(total.volume > 1e-12 * std::pow(size, 0.6))) return {};
    const double density = mass / total.volume;
    const Vector3 centre = total.first / total.volume;
    const Eigen::Matrix3d inertial = density * total.second - mass * centre * centre.transpose();
    return diagonalized(total.volume, centre, inertial.trace() * Eigen::Matrix3d::Identity() - inertial);
  }
  static MassProperties placed(const Part& part, double mass) {
    MassProperties properties = std::visit(Measure{mass}, part.shape);
    properties.center = part.pose.position + part.pose.orientation * properties.center;
    properties.axes = part.pose.orientation * properties.axes;
    return properties;
  }
  MassProperties operator()(const Compound& compound) const {
    if (compound.solid) {
      MassProperties scaled = *compound.solid;
      scaled.moments *= mass;
      return scaled;
    }
    if (compound.parts.size() == 1) return placed(compound.parts.front(), mass);
    std::vector<MassProperties> parts;  // of unit mass
    double volume = 0.0;
    Vector3 first = Vector3::Zero();
    for (const Part& given : compound.parts) {
      const MassProperties part = placed(given, 1.0);
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
    return diagonalized(volume, center, inertia);
  }
};

}  // namespace

MassProperties mass_properties(const Shape& shape, double mass) { return std::visit(Measure{mass}, shape); }

}  // namespace energymargin
