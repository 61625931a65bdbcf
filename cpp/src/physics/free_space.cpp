#include "physics/free_space.hpp"

#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>
#include <vector>

#include "energymargin/kinematics.hpp"
#include "physics/contacts/solid_pair.hpp"
#include "physics/placement.hpp"

namespace energymargin {
namespace {

// Share of the object's smallest half extent that it may be in a body, besides what it is at the start.
constexpr double touching = 2e-4;

template <typename Visit>
void for_each_piece(const btCollisionShape& shape, const btTransform& pose, const Visit& visit) {
  if (!shape.isCompound()) return visit(shape, pose);
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    for_each_piece(*compound.getChildShape(i), pose * compound.getChildTransform(i), visit);
  }
}

double distance_to_plane(const btConvexShape& shape, const btTransform& pose, const btStaticPlaneShape& plane,
                         const btTransform& plane_pose) {
  const btVector3 normal = plane_pose.getBasis() * plane.getPlaneNormal();
  const double offset = plane.getPlaneConstant() + normal.dot(plane_pose.getOrigin());
  return normal.dot(pose * shape.localGetSupportingVertex(-normal * pose.getBasis())) - offset;
}

double distance_to_solid(const btConvexShape& shape, const btTransform& pose, const btConvexShape& other,
                         const btTransform& other_pose, double reach) {
  const auto closest = SolidPair(shape, other).closest(pose, other_pose, reach);
  return closest ? closest->distance : reach;
}

}  // namespace

class FreeSpace::Bullet {
 public:
  Bullet(const Scene& scene, const State& state, std::size_t object) : scene_(scene), placement_(scene_) {
    placement_.restore(state);
    const BodyState start = Kinematics(scene)(state.data(), object);
    const Pose pose{start.position, start.orientation};
    const btCollisionObject& body = placement_.collider(object);
    // What the simulation makes of a body's frame is the same in every pose.
    const btTransform in_frame = to_bullet(pose).inverse() * body.getWorldTransform();
    for_each_piece(*body.getCollisionShape(), in_frame, [this](const btCollisionShape& shape, const btTransform& at) {
      add_piece(static_cast<const btConvexShape&>(shape), at);
    });
    tolerance_ = touching * scene.smallest_half_extent(object);
    for (std::size_t other = 0; other < scene.bodies().size(); ++other) {
      if (other != object && placement_.can_collide(object, other)) add_obstacles(other);
    }
    for (Obstacle& obstacle : obstacles_) {
      obstacle.depth = tolerance_ + std::max(0.0, -distance(to_bullet(pose), obstacle, 0.0));
    }
  }

  double clearance(const Pose& pose, double reach) const {
    const btTransform at = to_bullet(pose);
    double least = reach;
    for (const Obstacle& obstacle : obstacles_) {
      least = std::min(least, distance(at, obstacle, std::max(least, 0.0)) + obstacle.depth);
      if (least < 0.0) break;
    }
    return least;
  }

  double tolerance() const { return tolerance_; }

 private:
  // A convex piece of the object.
  struct Piece {
    const btConvexShape* shape;
    btTransform in_object;
    double radius;  // about the origin of its own frame
  };

  // A convex piece of another body, or a plane, where it stays.
  struct Obstacle {
    const btCollisionShape* shape;
    btTransform pose;
    btVector3 lower, upper;  // of its box along the axes
    double depth;            // that counts as touching
  };

  void add_piece(const btConvexShape& shape, const btTransform& in_object) {
    btVector3 centre;
    btScalar radius = 0.0;
    shape.getBoundingSphere(centre, radius);
    pieces_.push_back({&shape, in_object, radius + centre.length()});
  }

  void add_obstacles(std::size_t body) {
    const btCollisionObject& other = placement_.collider(body);
    for_each_piece(*other.getCollisionShape(), other.getWorldTransform(),
                   [this](const btCollisionShape& shape, const btTransform& pose) {
                     Obstacle obstacle{&shape, pose, {}, {}, 0.0};
                     shape.getAabb(pose, obstacle.lower, obstacle.upper);
                     obstacles_.push_back(obstacle);
                   });
  }

  double distance(const btTransform& object, const Obstacle& obstacle, double reach) const {
    const auto* plane = obstacle.shape->getShapeType() == STATIC_PLANE_PROXYTYPE
                            ? static_cast<const btStaticPlaneShape*>(obstacle.shape)
                            : nullptr;
    double least = reach;
    for (const Piece& piece : pieces_) {
      const btTransform at = object * piece.in_object;
      if (plane) {
        least = std::min(least, distance_to_plane(*piece.shape, at, *plane, obstacle.pose));
      } else if (!far(at.getOrigin(), piece.radius + std::max(least, 0.0), obstacle)) {
        const auto& solid = static_cast<const btConvexShape&>(*obstacle.shape);
        least = std::min(least, distance_to_solid(*piece.shape, at, solid, obstacle.pose, std::max(least, 0.0)));
      }
    }
    return least;
  }

  static bool far(const btVector3& centre, double reach, const Obstacle& obstacle) {
    btVector3 nearest = centre;
    nearest.setMax(obstacle.lower);
    nearest.setMin(obstacle.upper);
    return (centre - nearest).length2() > reach * reach;
  }

  Scene scene_;
  Placement placement_;
  std::vector<Piece> pieces_;
  std::vector<Obstacle> obstacles_;
  double tolerance_ = 0.0;
};

FreeSpace::FreeSpace(const Scene& scene, const State& state, std::size_t object)
    : bullet_(std::make_unique<Bullet>(scene, state, object)) {}
FreeSpace::~FreeSpace() = default;
FreeSpace::FreeSpace(FreeSpace&&) noexcept = default;
FreeSpace& FreeSpace::operator=(FreeSpace&&) noexcept = default;

double FreeSpace::clearance(const Pose& pose, double reach) { return bullet_->clearance(pose, reach); }
double FreeSpace::tolerance() const { return bullet_->tolerance(); }

}  // namespace energymargin
