#include "physics/shapes.hpp"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "energymargin/kinematics.hpp"
#include "physics/contacts/hull_shape.hpp"
#include "scene/margins.hpp"

namespace energymargin {
namespace {

constexpr double rounding = 1e-9;  // of poses: a share of the size, and rad

// A shape whose box of bounds has room around it. Bullet drops the contacts of a compound's part as soon as the boxes
// of bounds lie apart, be it by a rounding error, and the body would fall for a step.
template <typename Base>
struct Roomy : Base {
  using Base::Base;
  double room = 0.0;

  void getAabb(const btTransform& pose, btVector3& low, btVector3& high) const override {
    Base::getAabb(pose, low, high);
    low -= btVector3(room, room, room);
    high += btVector3(room, room, room);
  }
};

// A solid whose frame is at `pose` in Bullet's. The points of a hull are transformed to there; other solids keep their
// own frame.
struct Builder {
  Pose pose;
  double margin;
  double room;  // around its bounds

  template <typename Base, typename... Sizes>
  std::unique_ptr<Roomy<Base>> with_room(const Sizes&... sizes) const {
    auto shape = std::make_unique<Roomy<Base>>(sizes...);
    shape->room = room;
    return shape;
  }

  std::unique_ptr<btCollisionShape> operator()(const Box& box) const {
    auto shape = with_room<btBoxShape>(to_bullet(Vector3(0.5 * box.size)));
    shape->setMargin(margin);
    return shape;
  }
  std::unique_ptr<btCollisionShape> operator()(const Sphere& sphere) const {
    return with_room<btSphereShape>(sphere.radius);
  }
  std::unique_ptr<btCollisionShape> operator()(const Cylinder& cylinder) const {
    auto shape = with_room<btCylinderShapeZ>(btVector3(cylinder.radius, cylinder.radius, 0.5 * cylinder.length));
    shape->setMargin(margin);
    return shape;
  }
  std::unique_ptr<btCollisionShape> operator()(const Capsule& capsule) const {
    return with_room<btCapsuleShapeZ>(capsule.radius, capsule.length);
  }
  std::unique_ptr<btCollisionShape> operator()(const ConvexHull& hull) const {
    std::vector<Vector3> points;
    for (const Vector3& point : hull.points) points.push_back(pose.orientation * point + pose.position);
    return with_room<HullShape>(points, margin);
  }
};

double thinnest(const Solid& solid) {
  return std::visit([](const auto& of) { return smallest_half_extent(of); }, solid);
}

std::unique_ptr<btCollisionShape> solid_shape(const Solid& solid, const Pose& pose, std::optional<double> margin,
                                              double room = 0.0) {
  return std::visit(Builder{pose, collision_margin(thinnest(solid), margin), room}, solid);
}

// A solid at its body's centre of mass and along its axes, but for rounding, needs no compound around it.
bool is_nowhere_else(const Part& part) {
  const double size = thinnest(part.shape);
  return part.pose.position.norm() <= rounding * size &&
         part.pose.orientation.angularDistance(Quaternion::Identity()) <= rounding;
}

}  // namespace

btTransform bullet_pose(const Inertial& inertial, const BodyState& frame) {
  const BodyState center = state_at_point(inertial.center, frame);
  return btTransform(to_bullet(Quaternion(center.orientation * inertial.axes)), to_bullet(center.position));
}

CollisionShape collision_shape(const Body& body, std::optional<double> margin) {
  if (const auto* plane = std::get_if<Plane>(&body.shape)) {
    return {std::make_unique<btStaticPlaneShape>(to_bullet(plane->normal), plane->offset), {}, {}};
  }
  const Inertial inertial = body.principal_inertial();
  const Quaternion turn = inertial.axes.conjugate();
  std::vector<Part> parts;  // in Bullet's frame
  const auto add = [&](const Solid& solid, const Pose& in_body) {
    parts.push_back({solid, {turn * (in_body.position - inertial.center), turn * in_body.orientation}});
  };
  std::visit(
      [&](const auto& shape) {
        using Kind = std::decay_t<decltype(shape)>;
        if constexpr (std::is_same_v<Kind, Compound>) {
          for (const auto& [solid, pose] : shape.parts) add(solid, pose);
        } else if constexpr (!std::is_same_v<Kind, Plane>) {
          add(shape, Pose{});
        }
      },
      body.shape);
  if (parts.size() == 1 && (is_nowhere_else(parts[0]) || std::holds_alternative<ConvexHull>(parts[0].shape))) {
    return {solid_shape(parts[0].shape, parts[0].pose, margin), {}, {thinnest(parts[0].shape)}};
  }
  CollisionShape result;
  auto compound = std::make_unique<btCompoundShape>();
  const double room =
      gContactBreakingThreshold * reach_from(body.shape, inertial.center);  // Bullet's reach of a contact
  for (const auto& [solid, pose] : parts) {
    result.parts.push_back(solid_shape(solid, pose, margin, room));
    result.half_extents.push_back(thinnest(solid));
    const bool in_place = std::holds_alternative<ConvexHull>(solid);
    compound->addChildShape(to_bullet(in_place ? Pose{} : pose), result.parts.back().get());
  }
  result.shape = std::move(compound);
  return result;
}

std::vector<CollisionShape> collision_shapes(const Scene& scene) {
  std::vector<CollisionShape> shapes;
  for (const Body& body : scene.bodies()) shapes.push_back(collision_shape(body, scene.stepping().margin));
  return shapes;
}

}  // namespace energymargin
