#include "physics/shapes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "energymargin/kinematics.hpp"
#include "scene/body_constants.hpp"

namespace energymargin {
namespace {

constexpr double rounding = 1e-9;  // of poses: a share of the size, and rad

constexpr std::size_t most_kept_hulls = 256;  // that nothing has any more: some 10 MB

// A shape with room in its bounds: a compound's contacts end where boxes lie apart, be it by a rounding error.
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

// A solid at `pose` in Bullet's frame. The points of a hull are moved to there; other solids keep their own frame.
struct Builder {
  Pose pose;
  double margin;
  double room;  // around its bounds

  template <typename Base, typename... Sizes>
  std::shared_ptr<Roomy<Base>> with_room(const Sizes&... sizes) const {
    auto shape = std::make_shared<Roomy<Base>>(sizes...);
    shape->room = room;
    return shape;
  }

  std::shared_ptr<btCollisionShape> operator()(const Box& box) const {
    auto shape = with_room<btBoxShape>(to_bullet(Vector3(0.5 * box.size)));
    shape->setMargin(margin);
    return shape;
  }
  std::shared_ptr<btCollisionShape> operator()(const Sphere& sphere) const {
    return with_room<btSphereShape>(sphere.radius);
  }
  std::shared_ptr<btCollisionShape> operator()(const Cylinder& cylinder) const {
    auto shape = with_room<btCylinderShapeZ>(btVector3(cylinder.radius, cylinder.radius, 0.5 * cylinder.length));
    shape->setMargin(margin);
    return shape;
  }
  std::shared_ptr<btCollisionShape> operator()(const Capsule& capsule) const {
    return with_room<btCapsuleShapeZ>(capsule.radius, capsule.length);
  }
  std::shared_ptr<btCollisionShape> operator()(const ConvexHull& hull) const {
    std::vector<Vector3> points;
    for (const Vector3& point : hull.points) points.push_back(pose.orientation * point + pose.position);
    return shared_hull(points);
  }

  // Equal hulls are one, and so are their tables: a scene that is made again and again, as for each draw of a belief,
  // finds them made, as long as they are among the last ones or something has them.
  std::shared_ptr<btCollisionShape> shared_hull(const std::vector<Vector3>& points) const {
    static std::mutex changing;
    static std::map<std::vector<double>, std::weak_ptr<btCollisionShape>> made;
    static std::deque<std::shared_ptr<btCollisionShape>> last;
    std::vector<double> key{margin, room};
    for (const Vector3& point : points) key.insert(key.end(), point.begin(), point.end());
    const auto find = [&] {
      const std::lock_guard<std::mutex> alone(changing);
      const auto known = made.find(key);
      return known == made.end() ? nullptr : known->second.lock();
    };
    if (auto hull = find()) return hull;
    const std::shared_ptr<btCollisionShape> hull = with_room<HullShape>(points, margin);
    const std::lock_guard<std::mutex> alone(changing);
    for (auto each = made.begin(); each != made.end();) each = each->second.expired() ? made.erase(each) : ++each;
    const auto known = made.emplace(std::move(key), hull).first->second.lock();
    if (known != hull) return known;
    last.push_back(hull);
    if (last.size() > most_kept_hulls) last.pop_front();
    return hull;
  }
};

std::shared_ptr<btCollisionShape> solid_shape(const Solid& solid, const Pose& pose, double half_extent,
                                              std::optional<double> margin, double room = 0.0) {
  return std::visit(Builder{pose, collision_margin(half_extent, margin), room}, solid);
}

// A solid at its body's centre of mass and along its axes, but for rounding, needs no compound around it.
bool is_nowhere_else(const Part& part, double half_extent) {
  return part.pose.position.norm() <= rounding * half_extent &&
         part.pose.orientation.angularDistance(Quaternion::Identity()) <= rounding;
}

// The distance of the farthest corner, or of the middle of what is round, from the body's origin, or a little more:
// Bullet rounds a cylinder's rim by its margin.
double core_reach(const btConvexShape& shape, const btTransform& in_body) {
  const int kind = shape.getShapeType();
  const bool is_round = kind == SPHERE_SHAPE_PROXYTYPE || kind == CAPSULE_SHAPE_PROXYTYPE;
  btVector3 farthest(0, 0, 0);
  for (int axis = 0; axis < 3; ++axis) {
    btVector3 along(0, 0, 0);
    for (const double sign : {-1.0, 1.0}) {
      along[axis] = sign;
      const btVector3 local = along * in_body.getBasis();
      const btVector3 point =
          is_round ? shape.localGetSupportVertexWithoutMarginNonVirtual(local) : shape.localGetSupportingVertex(local);
      farthest[axis] = std::max(farthest[axis], along.dot(in_body(point)));
    }
  }
  return farthest.length() + (kind == CYLINDER_SHAPE_PROXYTYPE ? shape.getMarginNonVirtual() : 0.0);
}

// The solids of a body, in Bullet's frame.
std::vector<Part> solids_in_bullet(const Shape& shape, const Inertial& inertial) {
  const Quaternion turn = inertial.axes.conjugate();
  std::vector<Part> solids = solids_of(shape);
  for (Part& solid : solids) {
    solid.pose = {turn * (solid.pose.position - inertial.center), turn * solid.pose.orientation};
  }
  return solids;
}

void add_piece(CollisionShape& to, const btCollisionShape& piece, const btTransform& in_body, bool at_origin,
               double half_extent) {
  const auto& shape = static_cast<const btConvexShape&>(piece);
  to.pieces.push_back({&shape, in_body, at_origin, core_reach(shape, in_body), half_extent, bounds_of(shape, in_body)});
  to.reach = std::max(to.reach, to.pieces.back().reach);
}

}  // namespace

btTransform bullet_pose(const Inertial& inertial, const BodyState& frame) {
  const BodyState center = state_at_point(inertial.center, frame);
  return btTransform(to_bullet(Quaternion(center.orientation * inertial.axes)), to_bullet(center.position));
}

BodyState frame_state(const Inertial& inertial, const btTransform& pose, const Vector3& velocity,
                      const Vector3& angular_velocity) {
  const Quaternion orientation = from_bullet(pose.getRotation()) * inertial.axes.conjugate();
  return state_at_point(-inertial.center,
                        {from_bullet(pose.getOrigin()), orientation.normalized(), velocity, angular_velocity});
}

std::shared_ptr<const CollisionShape> make_collision_shape(const Body& body, const BodyConstants& constants,
                                                           std::optional<double> margin) {
  auto result = std::make_shared<CollisionShape>();
  if (const auto* plane = std::get_if<Plane>(&body.shape)) {
    result->shape = std::make_unique<btStaticPlaneShape>(to_bullet(plane->normal), plane->offset);
    return result;
  }
  const Inertial& inertial = constants.inertial();
  const std::vector<Part> parts = solids_in_bullet(body.shape, inertial);
  const std::vector<double>& half_extents = constants.half_extents();
  if (parts.size() == 1 &&
      (is_nowhere_else(parts[0], half_extents[0]) || std::holds_alternative<ConvexHull>(parts[0].shape))) {
    result->shape = solid_shape(parts[0].shape, parts[0].pose, half_extents[0], margin);
    add_piece(*result, *result->shape, btTransform::getIdentity(), true, half_extents[0]);
    return result;
  }
  auto compound = std::make_unique<btCompoundShape>();
  const double room =
      gContactBreakingThreshold * reach_from(body.shape, inertial.center);  // Bullet's reach of a contact
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto& [solid, pose] = parts[i];
    result->parts.push_back(solid_shape(solid, pose, half_extents[i], margin, room));
    const btTransform in_body = to_bullet(std::holds_alternative<ConvexHull>(solid) ? Pose{} : pose);
    compound->addChildShape(in_body, result->parts.back().get());
    add_piece(*result, *result->parts.back(), in_body, false, half_extents[i]);
  }
  result->shape = std::move(compound);
  return result;
}

}  // namespace energymargin
