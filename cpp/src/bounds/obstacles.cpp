#include "bounds/obstacles.hpp"

#include <algorithm>

#include "bounds/infinity.hpp"
#include "bounds/overlap.hpp"
#include "energymargin/kinematics.hpp"
#include "physics/contacts/collision_filter.hpp"
#include "scene/margins.hpp"

namespace energymargin::bounds {
namespace {

// So much deeper than that still seems free: a share of the allowed depth.
constexpr double nearly_free = 0.25;

// Planes push out whatever is in them. This share of the object's smallest half extent is left to what they miss.
constexpr double share_in_plane = 0.01;

constexpr double any_depth = infinity;

}  // namespace

Obstacles::Obstacles(const Problem& problem, std::size_t object, const std::vector<bool>& immovable,
                     const ObjectSpace& space)
    : space_(space) {
  const Scene& scene = problem.scene;
  const CollisionFilter can_collide(scene);
  const Kinematics kinematics(scene);
  const Pose start = space.pose(space.start());
  const double in_plane = share_in_plane * scene.smallest_half_extent(object);
  for (std::size_t body = 0; body < scene.bodies().size(); ++body) {
    if (body == object || !immovable[body] || !can_collide(object, body)) continue;
    const BodyState state = kinematics(problem.state.data(), body);
    const Pose pose{state.position, state.orientation};
    if (const auto* plane = std::get_if<Plane>(&scene.bodies()[body].shape)) {
      const Vector3 normal = pose.orientation * plane->normal;
      const Plane placed{normal, plane->offset + normal.dot(pose.position)};
      for (std::size_t i = 0; i < space.pieces().size(); ++i) {
        const double depth = overlap_with_plane(space.pieces()[i].whole, start, placed);
        planes_.push_back({i, placed, in_plane + std::max(depth, 0.0)});
      }
      continue;
    }
    for (const ConvexPiece& obstacle : convex_pieces(scene.bodies()[body].shape, pose, scene.stepping().margin)) {
      for (std::size_t i = 0; i < space.pieces().size(); ++i) {
        const ConvexPiece& whole = space.pieces()[i].whole;
        const double allowed =
            allowed_overlap(whole.margin() + obstacle.margin(), whole.half_extent(), obstacle.half_extent());
        if (find_overlap(whole, start, obstacle, {whole.center(), 0.0}, any_depth).middle <= allowed)
          pairs_.push_back({i, obstacle, allowed});
      }
    }
  }
}

Occupancy Obstacles::occupancy(const PoseCell& cell) const {
  Occupancy occupancy;
  const Pose pose = space_.pose(cell.center());
  const Coordinates half = cell.half();
  const double slide = half.head<3>().norm();
  const double turn = chord(half[turn_axis]);
  const auto add = [&](const Overlap& depth, double allowed, double motion) {
    occupancy.blocked = depth.certain > allowed + slide;
    occupancy.clear = occupancy.clear && depth.middle < allowed - motion;
    occupancy.center_free = occupancy.center_free && depth.middle <= (1.0 + nearly_free) * allowed;
    return occupancy.blocked;
  };
  for (const PlanePair& pair : planes_) {
    const ObjectPiece& piece = space_.pieces()[pair.piece];
    const double way = piece.reach * turn;
    const double depth = overlap_with_plane(piece.piece, pose, pair.plane);
    if (add({depth, depth - way}, pair.allowed, slide + way)) return occupancy;
  }
  for (const Pair& pair : pairs_) {
    const ObjectPiece& piece = space_.pieces()[pair.piece];
    const double motion = slide + piece.reach * turn;
    const Vector3 center = pose.position + pose.orientation * piece.piece.center();
    if (pair.obstacle.depth(center) + piece.piece.radius() < -motion) continue;
    const Turns turns{space_.reference(), turn};
    const Overlap depth = find_overlap(piece.piece, pose, pair.obstacle, turns, slide + pair.allowed);
    if (add(depth, pair.allowed, motion)) return occupancy;
  }
  return occupancy;
}

bool Obstacles::same_along(int axis) const {
  const auto slopes = [axis](const PlanePair& pair) { return pair.plane.normal[axis] != 0.0; };
  return pairs_.empty() && std::none_of(planes_.begin(), planes_.end(), slopes);
}

double Obstacles::extent_from(const Vector3& point) const {
  double extent = 0.0;
  for (const Pair& pair : pairs_) {
    extent = std::max(extent, (pair.obstacle.center() - point).norm() + pair.obstacle.radius());
  }
  return extent;
}

}  // namespace energymargin::bounds
