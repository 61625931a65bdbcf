// Edges between pieces that are flush: they are no steps.

#include <algorithm>
#include <cmath>

#include "physics/contacts/collision_pairs.hpp"

namespace energymargin {
namespace {

constexpr double seam = 2.0;     // of what a body is pressed into another: an edge that overlaps by less is no step
constexpr double aligned = 0.9;  // cosine

// An edge is flush with a face that is as near to it as this share of a contact's reach, and to whose side it is as
// near as the whole.
constexpr double flush = 1e-2;

// Cosines between normals that are one, and between a face's normal and that of an edge beside it.
constexpr double one_normal = 1.0 - 1e-9, slightly_turned = 0.5;

// Whether a piece has a face with this normal.
bool has_face(const InnerShape& solid, const btTransform& pose, const btVector3& normal) {
  bool has = false;
  solid.for_each_face_near(normal * pose.getBasis(), one_normal, [&](const btVector3&, double) { has = true; });
  return has;
}

// Whether a point is in a piece with faces, or as near to it as that.
bool is_in(const InnerShape& solid, const btTransform& pose, const btVector3& point, double near) {
  constexpr double all_faces = -2.0;  // cosine
  const btVector3 at = pose.invXform(point);
  bool inside = true;
  solid.for_each_face_near(
      at, all_faces, [&](const btVector3& face, double offset) { inside = inside && face.dot(at) <= offset + near; });
  return inside;
}

}  // namespace

CollisionPairs::Side CollisionPairs::side(const PieceContacts& contacts, bool first) const {
  const CollisionPair& pair = *contacts.pair;
  const std::size_t body = first ? pair.first : pair.second;
  const PieceIndices& at = pair.order[contacts.pieces];
  const std::size_t piece = first ? at.a : at.b;
  const InnerShape* const solid = pair.solids.empty() ? nullptr
                                  : first             ? &pair.solids[contacts.pieces].a()
                                                      : &pair.solids[contacts.pieces].b();
  return {body, piece, solid};
}

btTransform CollisionPairs::pose_of(const Side& side) const {
  return shapes_[side.body]->pieces[side.piece].pose(poses_[side.body]);
}

// A piece that touches a face goes along it, and does not meet the edge of another piece that is flush with it.
void CollisionPairs::drop_covered(const PieceContacts& at_edge, const PieceContacts& on_face,
                                  std::vector<bool>& drops) const {
  for (const bool edge_first : {true, false}) {
    for (const bool face_first : {true, false}) {
      const Side common = side(at_edge, edge_first), of_edge = side(at_edge, !edge_first);
      const Side same = side(on_face, face_first), of_face = side(on_face, !face_first);
      if (common.body != same.body || common.piece != same.piece) continue;
      const ContactPoint &edge = points_[at_edge.begin], &face = points_[on_face.begin];
      const btVector3 slanted = edge.normal * (edge_first ? 1.0 : -1.0),
                      normal = face.normal * (face_first ? 1.0 : -1.0);
      const double cosine = slanted.dot(normal);
      if (cosine < slightly_turned || cosine > one_normal || !of_edge.solid) continue;
      if (has_face(*of_edge.solid, pose_of(of_edge), slanted)) continue;
      if (of_face.solid && !has_face(*of_face.solid, pose_of(of_face), normal)) continue;
      const double near = on_face.pair->near.depth;
      for (std::size_t i = at_edge.begin; i < at_edge.end; ++i) {
        const btVector3& point = edge_first ? points_[i].on_b : points_[i].on_a;
        const double height = normal.dot(point - (face_first ? face.on_b : face.on_a));
        if (std::abs(height) > flush * near) continue;
        if (!of_face.solid || is_in(*of_face.solid, pose_of(of_face), point, near)) drops[i] = true;
      }
    }
  }
}

bool CollisionPairs::is_seam(const PointAtEdge& at) const {
  const ContactPoint& point = points_[at.point];
  return std::any_of(points_.begin(), points_.end(), [&](const ContactPoint& other) {
    if (at.edge.overlap > seam * std::max(0.0, -other.distance)) return false;
    const double along = other.normal.dot(at.edge.across);
    return ((other.a == point.a || other.b == point.b) && along > aligned) ||
           ((other.b == point.a || other.a == point.b) && along < -aligned);
  });
}

void CollisionPairs::drop_seams() {
  if (edges_.empty() && groups_.size() < 2) return;
  std::vector<bool> drops(points_.size());
  for (const PointAtEdge& at : edges_) drops[at.point] = is_seam(at);
  const auto may_cover = [this](const PieceContacts& on_face, const PieceContacts& at_edge) {
    const CollisionPair &of_face = *on_face.pair, &of_edge = *at_edge.pair;
    const double cosine = std::abs(points_[on_face.begin].normal.dot(points_[at_edge.begin].normal));
    return cosine >= slightly_turned && cosine <= one_normal && !of_edge.solids.empty() &&
           (of_face.first == of_edge.first || of_face.first == of_edge.second || of_face.second == of_edge.first ||
            of_face.second == of_edge.second);
  };
  for (const PieceContacts& at_edge : groups_) {
    for (const PieceContacts& on_face : groups_) {
      if (may_cover(on_face, at_edge)) drop_covered(at_edge, on_face, drops);
    }
  }
  std::size_t i = 0;
  const auto is_dropped = [&](const ContactPoint&) { return drops[i++]; };
  points_.erase(std::remove_if(points_.begin(), points_.end(), is_dropped), points_.end());
  edges_.clear();
}

}  // namespace energymargin
