#pragma once
// What is in the object's way: the bodies that stay where they are. Others may give way, and are left out.

#include <algorithm>
#include <vector>

#include "bounds/object_space.hpp"
#include "physics/contacts/collision_filter.hpp"
#include "scene/body_constants.hpp"

namespace energymargin::bounds {

//! What is certain about the poses of a cell.
struct Occupancy {
  bool blocked = false;     //!< the object is too deep in an obstacle in all of them
  bool clear = true;        //!< it seems to be in none in any of them
  bool center_free = true;  //!< it seems to be in none in the middle
};

//! The object may be in an obstacle as deep as the simulation lets bodies sink into each other, or as it is at the
//! start. A piece that starts deeper than the simulation would let it come is not held by that obstacle.
class Obstacles {
 public:
  //! The space outlives this.
  Obstacles(const Subject& subject, const ObjectSpace& space) : space_(space) {
    const Scene& scene = subject.problem.scene;
    const std::size_t object = subject.object;
    const CollisionFilter can_collide(scene);
    const Pose start = space.pose(space.start());
    const double in_plane = share_in_plane * scene.smallest_half_extent(object);
    for (std::size_t body = 0; body < scene.bodies().size(); ++body) {
      if (body == object || !subject.immovable[body] || !can_collide(object, body)) continue;
      const BodyState state = subject.at(body);
      const Pose pose{state.position, state.orientation};
      if (const auto* plane = std::get_if<Plane>(&scene.bodies()[body].shape)) {
        const Vector3 normal = pose.orientation * plane->normal;
        const Plane placed{normal, plane->offset + normal.dot(pose.position)};
        for (std::size_t i = 0; i < space.pieces().size(); ++i) {
          const double depth = penetration_of_plane(space.pieces()[i].whole, start, placed);
          planes_.push_back({i, placed, in_plane + std::max(depth, 0.0)});
        }
        continue;
      }
      const Shape& shape = scene.bodies()[body].shape;
      for (std::size_t i = 0; i < space.pieces().size(); ++i) {
        const ConvexPiece& whole = space.pieces()[i].whole;
        const std::optional<double> margin = whole.is_round() ? sharp : scene.stepping().margin;
        for (const ConvexPiece& obstacle : convex_pieces(shape, pose, margin)) {
          const double margins = whole.margin() + obstacle.margin();
          const double allowed =
              pressed_deeper * allowed_penetration(margins, whole.half_extent(), obstacle.half_extent());
          if (find_penetration(whole, start, obstacle, {whole.center(), 0.0}, any_depth).middle <= allowed)
            pairs_.push_back({i, obstacle, allowed});
        }
      }
    }
  }

  Occupancy occupancy(const PoseCell& cell) const {
    Occupancy occupancy;
    const Pose pose = space_.pose(cell.center());
    const Coordinates half = cell.half();
    const double slide = half.head<3>().norm();
    const double turn = chord(half[turn_axis]);
    const auto add = [&](const Penetration& depth, double allowed, double motion) {
      occupancy.blocked = depth.certain > allowed + slide;
      occupancy.clear = occupancy.clear && depth.middle < allowed - motion;
      occupancy.center_free = occupancy.center_free && depth.middle <= (1.0 + nearly_free) * allowed;
      return occupancy.blocked;
    };
    for (const PlanePair& pair : planes_) {
      const ObjectPiece& piece = space_.pieces()[pair.piece];
      const double way = piece.reach * turn;
      const double depth = penetration_of_plane(piece.piece, pose, pair.plane);
      if (add({depth, depth - way}, pair.allowed, slide + way)) return occupancy;
    }
    for (const Pair& pair : pairs_) {
      const ObjectPiece& piece = space_.pieces()[pair.piece];
      const double motion = slide + piece.reach * turn;
      const Vector3 center = pose.position + pose.orientation * piece.piece.center();
      if (pair.obstacle.depth(center) + piece.piece.radius() < -motion) continue;
      const Turns turns{space_.reference(), turn};
      const Penetration depth = find_penetration(piece.piece, pose, pair.obstacle, turns, slide + pair.allowed);
      if (add(depth, pair.allowed, motion)) return occupancy;
    }
    return occupancy;
  }

  //! Whether nothing is different elsewhere along an axis of the world.
  bool same_along(int axis) const {
    const auto slopes = [axis](const PlanePair& pair) { return pair.plane.normal[axis] != 0.0; };
    return pairs_.empty() && std::none_of(planes_.begin(), planes_.end(), slopes);
  }

  //! A distance from a point beyond which there are planes alone [m].
  double extent_from(const Vector3& point) const {
    double extent = 0.0;
    for (const Pair& pair : pairs_) {
      extent = std::max(extent, (pair.obstacle.center() - point).norm() + pair.obstacle.radius());
    }
    return extent;
  }

 private:
  // So much deeper than that still seems free: a share of the allowed depth.
  static constexpr double nearly_free = 0.25;

  // Planes push out whatever is in them. This share of the object's smallest half extent is left to what they miss.
  static constexpr double share_in_plane = 0.01;

  static constexpr double any_depth = infinity;

  static constexpr double sharp = 0.0;  // margin: as a sphere or a capsule meets edges

  static constexpr int halvings = 6;  // of the step in which the sum of the depths is climbed

  // Lower bounds of the least way by which one of two pieces has to move for the other to be free [m].
  struct Penetration {
    double middle;   // as they stand
    double certain;  // also if the first one turns
  };

  // How a piece may be turned: each point by up to `chord` times its distance from a point of the piece's frame.
  struct Turns {
    Vector3 about;
    double chord;
  };

  // `pose` places `piece` in the frame of `other`. The search for better bounds ends once the certain one is above
  // `enough`. A bound is the radius piece.depth(p) + other.depth(p) of a ball about any point p, the highest found: no
  // shorter way parts the two. As the piece turns, its part of the ball moves with p. Both depths are concave.
  static Penetration find_penetration(const ConvexPiece& piece, const Pose& pose, const ConvexPiece& other,
                                      const Turns& turns, double enough) {
    const Quaternion inverse = pose.orientation.conjugate();
    const auto placed = [&](const Vector3& point) { return Vector3(pose.position + pose.orientation * point); };
    const auto in_piece = [&](const Vector3& point) { return Vector3(inverse * (point - pose.position)); };
    Penetration best{-infinity, -infinity};
    Vector3 at = Vector3::Zero();  // where the certain one is highest so far, in the frame of `other`
    const auto raise = [&](const Vector3& point) {
      const Vector3 local = in_piece(point);
      const double sum = piece.depth(local) + other.depth(point);
      const double certain = sum - turns.chord * (local - turns.about).norm();
      best.middle = std::max(best.middle, sum);
      if (certain <= best.certain) return false;
      best.certain = certain;
      at = point;
      return true;
    };
    const Vector3 center = placed(piece.center());
    raise(center);
    raise(other.near(center));
    raise(other.center());
    raise(placed(piece.near(in_piece(other.center()))));
    if (best.certain > enough || best.middle < -piece.radius() - other.radius()) return best;
    for (const Vector3& corner : piece.corners()) raise(placed(corner));
    for (const Vector3& corner : other.corners()) raise(corner);
    // To and fro between the nearest points, and then along the axes of both.
    for (int i = 0; i < halvings && raise(other.near(placed(piece.near(in_piece(at))))); ++i) {
    }
    double step = 0.5 * std::min(piece.radius(), other.radius());
    const Eigen::Matrix3d turn = pose.orientation.toRotationMatrix();
    for (int i = 0; i < halvings && best.certain <= enough; ++i, step *= 0.5) {
      for (int axis = 0; axis < 3; ++axis) {
        for (const double way : {-step, step}) {
          raise(at + way * turn.col(axis));
          raise(at + way * Vector3::Unit(axis));
        }
      }
    }
    return best;
  }

  // The penetration depth of a piece and the half space below a plane, in whose frame `pose` is [m].
  static double penetration_of_plane(const ConvexPiece& piece, const Pose& pose, const Plane& plane) {
    const Vector3 down = pose.orientation.conjugate() * -plane.normal;
    return plane.offset - plane.normal.dot(pose.position + pose.orientation * piece.support(down));
  }

  struct Pair {
    std::size_t piece;  // of the object
    ConvexPiece obstacle;
    double allowed;  // depth [m]
  };
  struct PlanePair {
    std::size_t piece;
    Plane plane;  // in the world
    double allowed;
  };

  const ObjectSpace& space_;
  std::vector<Pair> pairs_;
  std::vector<PlanePair> planes_;
};

}  // namespace energymargin::bounds
