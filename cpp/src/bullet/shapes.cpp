#include "shapes.hpp"

#include <LinearMath/btConvexHullComputer.h>

#include <algorithm>

namespace energymargin {
namespace {

// Bullet's default of 4 cm would swallow a 10 cm box; a twentieth keeps GJK well conditioned at any scale.
constexpr double margin_share = 0.05;

struct Builder {
  double margin;

  std::unique_ptr<btCollisionShape> operator()(const Plane& plane) const {
    return std::make_unique<btStaticPlaneShape>(to_bullet(plane.normal), plane.offset);
  }
  std::unique_ptr<btCollisionShape> operator()(const Box& box) const {
    auto shape = std::make_unique<btBoxShape>(to_bullet(Vector3(0.5 * box.size)));
    shape->setMargin(margin);
    return shape;
  }
  std::unique_ptr<btCollisionShape> operator()(const Sphere& sphere) const {
    return std::make_unique<btSphereShape>(sphere.radius);
  }
  std::unique_ptr<btCollisionShape> operator()(const Cylinder& cylinder) const {
    auto shape = std::make_unique<btCylinderShapeZ>(btVector3(cylinder.radius, cylinder.radius, 0.5 * cylinder.length));
    shape->setMargin(margin);
    return shape;
  }
  std::unique_ptr<btCollisionShape> operator()(const Capsule& capsule) const {
    return std::make_unique<btCapsuleShapeZ>(capsule.radius, capsule.length);
  }
  std::unique_ptr<btCollisionShape> operator()(const ConvexHull& hull) const {
    const Quaternion to_axes = mass_properties(hull, 1.0).axes.conjugate();
    std::vector<Vector3> points;
    for (const Vector3& point : hull.points) points.push_back(to_axes * point);
    // Bullet adds the margin outside of a hull, so the hull is shrunk by it first.
    btConvexHullComputer computer;
    const double shrunk =
        computer.compute(points.front().data(), sizeof(Vector3), static_cast<int>(points.size()), margin, 0.5);
    auto shape = std::make_unique<btConvexHullShape>();
    for (int i = 0; i < computer.vertices.size(); ++i) shape->addPoint(computer.vertices[i], false);
    shape->recalcLocalAabb();
    shape->setMargin(shrunk);
    return shape;
  }
};

}  // namespace

std::unique_ptr<btCollisionShape> collision_shape(const Shape& shape, std::optional<double> margin) {
  const double most = smallest_half_extent(shape);
  return std::visit(Builder{margin ? std::min(*margin, 0.5 * most) : margin_share * most}, shape);
}

}  // namespace energymargin
