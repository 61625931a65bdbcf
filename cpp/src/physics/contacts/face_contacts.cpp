#include "physics/contacts/face_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "physics/contacts/patches.hpp"
#include "physics/contacts/rims.hpp"

namespace energymargin {

using namespace outlines;

namespace {

// Points so near are one: a share of the depth.
constexpr double same_point = 1e-3;

// A flat face bears alone if it is more than this share of what is in reach.
constexpr double mostly = 0.5;

// Faces that are not flat may miss the deepest point, by more than this share of the margins.
constexpr double same_depth = 0.1;

// Shares of the margins.
constexpr double clearly_farther = 1e-6;  // along this axis, more than along another
constexpr double least_overlap = 1e-2;    // of faces across an edge, of the smaller margin

// Cosines, of axes that are one, and of those of two faces with an edge between them.
constexpr double same_direction = 1.0 - 1e-11, across_an_edge = 0.7;

// Cosines between a normal and the faces that may have the right one.
constexpr double near_face = 0.5, any_face = -0.02;

// Whether the corners of the other side are visited too: those of a thin plate are near.
bool has_back(const InnerShape& solid) { return solid.is_box() || solid.is_hull(); }

// Calls `visit` with the points that can be corners of a solid's outermost face along `direction`, in its frame, and so
// near to the farthest as `depth`, or nearly so.
template <typename Visit>
void for_each_corner(const InnerShape& solid, const btVector3& direction, double depth, const Visit& visit) {
  if (has_back(solid)) return solid.for_each_corner_near(direction, depth, visit);
  if (solid.kind() == CAPSULE_SHAPE_PROXYTYPE) {
    for (const double z : {-solid.half().z(), solid.half().z()}) visit(btVector3(0.0, 0.0, z));
  }
  if (!solid.is_cylinder()) return;  // a sphere has none
  const btVector3 half = solid.half() + btVector3(solid.margin(), solid.margin(), solid.margin());
  const double across = std::hypot(direction.x(), direction.y());
  if (across > lying) {
    const double scale = half.x() / across;
    for (const double z : {-half.z(), half.z()}) visit(btVector3(direction.x() * scale, direction.y() * scale, z));
    return;
  }
  for_each_rim_corner(half.x(), direction.z() < 0.0 ? -half.z() : half.z(), direction, visit);
}

// How far a solid's corners reach along a direction in its frame, at least and at most.
std::pair<double, double> extent(const InnerShape& solid, const btVector3& direction) {
  if (solid.is_hull()) return solid.extent(direction);
  std::pair<double, double> along(BT_LARGE_FLOAT, -BT_LARGE_FLOAT);
  for_each_corner(solid, direction, BT_LARGE_FLOAT, [&](const btVector3& point) {
    along.first = std::min(along.first, direction.dot(point));
    along.second = std::max(along.second, direction.dot(point));
  });
  return along;
}

// The outermost face of a solid along `outward`, 1 or -1 times the normal.
void find_face(const InnerShape& solid, const btTransform& pose, const ContactPlane& plane, double outward,
               double depth, Face& face, Face& scratch) {
  face.clear();
  const btVector3 direction = plane.normal * outward * pose.getBasis();
  const std::pair<double, double> along_normal = extent(solid, direction);
  const double most = along_normal.second;
  if (has_back(solid)) depth = std::min(depth, 0.5 * (most - along_normal.first));
  const double outside = has_back(solid) || solid.is_cylinder() ? 0.0 : solid.margin();
  const auto add = [&](const btVector3& point) {
    const double along = direction.dot(point);
    if (along < most - depth) return;
    face.push_back(plane(pose(point)));
    face.back().height += outward * (along + outside - along);
  };
  for_each_corner(solid, direction, depth, add);
  const std::size_t found = face.size();
  order(face, scratch, outward, depth);
  if (face.size() == found) return;
  // Corners inside of the outline: of a face that a bevel or a chamfer surrounds, which are what bears.
  const HullShape::Face* const flat = solid.face_along(direction);
  if (!flat || flat->area < mostly * area(face)) return;
  face.clear();
  for (const btVector3& corner : flat->corners) add(corner);
  order(face, scratch, outward, depth);
}

}  // namespace

const std::vector<FacePoint>& FaceContacts::contacts(SolidPair& solids, const btTransform& pose_a,
                                                     const btTransform& pose_b, const ContactReach& near,
                                                     btVector3& normal) {
  points_.clear();
  edge_.reset();
  const double rounded = solids.have_edges() ? most_rounded * solids.margins() : 0.0;
  if (const auto found = solids.closest(pose_a, pose_b, near.reach() + rounded)) {
    const ClosestPoints closest = solids.sharp_side(pose_a, pose_b, *found);
    normal = closest.normal;
    find_sharp(solids, pose_a, pose_b, closest, near, normal);
    if (near.early > 0.0 && !points_.empty()) add_corners(solids, pose_a, pose_b, normal, near);
    if (near.patch > 0.0) spread(points_, normal, near.patch);
  }
  return points_;
}

void FaceContacts::find_sharp(SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b,
                              const ClosestPoints& closest, const ContactReach& near, btVector3& normal) {
  const double same = same_depth * solids.margins();
  const double deep = closest.distance + same;
  const bool passes = closest.distance > same;
  const bool gives = solids.have_edges() && near.compliant;
  std::optional<btVector3> axis;
  if (gives || (solids.have_edges() && closest.distance > -same)) {
    const bool is_of_face = find_axes(solids, pose_a, pose_b, closest, gives ? any_face : near_face);
    if (gives || !(is_of_face || faces_.empty())) axis = farthest_axis(solids, pose_a, pose_b, normal);
  }
  find(solids, pose_a, pose_b, axis.value_or(normal), near);
  std::optional<Edge> edge;
  if (axis && *axis != normal) {
    edge = edge_of(solids, pose_a, pose_b, *axis, normal);
  } else if (gives) {
    edge = next_face(solids, pose_a, pose_b, *axis);
  }
  if (edge) {
    const bool overlap = edge->overlap > least_overlap * std::min(solids.a().margin(), solids.b().margin());
    if (!overlap && passes) return points_.clear();
    if (points_.empty() && (gives || solids.a().is_cylinder() || solids.b().is_cylinder())) {
      // A round face has only some of its rim, which may be beside the other one.
      const double gap = solids.gap(pose_a, pose_b, *axis);
      if (gives) points_.push_back({closest.on_b, closest.on_b, gap});
      edge_ = {*axis, std::max(0.0, -gap)};
    }
    if (overlap && !points_.empty() && least_distance() <= deep) {
      normal = *axis;
      if (passes || gives) edge_ = edge;
      return;
    }
  } else if (!points_.empty()) {
    if (axis && points_.size() > 1) {  // between parallel edges: no nearer than rounded ones
      const double nearer = std::max(0.0, closest.distance - least_distance());
      for (FacePoint& point : points_) point.distance += nearer;
    }
    if (least_distance() <= deep) return;
  }
  points_.clear();
  if (closest.distance <= near.reach()) points_.push_back({closest.on_b, closest.on_b, closest.distance});
}

double FaceContacts::least_distance() const {
  double least = BT_LARGE_FLOAT;
  for (const FacePoint& point : points_) least = std::min(least, point.distance);
  return least;
}

bool FaceContacts::find_axes(const SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b,
                             const ClosestPoints& closest, double near) {
  faces_.clear();
  bool is_of_face = false;
  const auto add_faces = [&](const InnerShape& solid, const btTransform& pose, double outward, const btVector3& other) {
    const btVector3 from = pose.invXform(other);
    solid.for_each_face_near(closest.normal * outward * pose.getBasis(), near,
                             [&](const btVector3& face, double offset) {
                               const btVector3 axis = pose.getBasis() * face * outward;
                               is_of_face = is_of_face || axis.dot(closest.normal) >= same_direction;
                               faces_.push_back({axis, face.dot(from) - offset});
                             });
  };
  add_faces(solids.a(), pose_a, -1.0, closest.on_b);
  add_faces(solids.b(), pose_b, 1.0, closest.on_b + closest.normal * closest.distance);
  return is_of_face;
}

btVector3 FaceContacts::farthest_axis(const SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b,
                                      const btVector3& normal) const {
  btVector3 best = normal;
  double farthest = solids.gap(pose_a, pose_b, best) + clearly_farther * solids.margins();
  for (const auto& [axis, most] : faces_) {
    if (most <= farthest) continue;
    const double gap = solids.gap(pose_a, pose_b, axis);
    if (gap <= farthest) continue;
    farthest = gap;
    best = axis;
  }
  return best;
}

std::optional<FaceContacts::Edge> FaceContacts::next_face(const SolidPair& solids, const btTransform& pose_a,
                                                          const btTransform& pose_b, const btVector3& normal) const {
  std::optional<Edge> next;
  double overlap = BT_LARGE_FLOAT;
  for (const auto& [axis, most] : faces_) {
    if (most <= -overlap || std::abs(axis.dot(normal)) > across_an_edge) continue;
    const double gap = solids.gap(pose_a, pose_b, axis);
    if (gap <= -overlap) continue;
    overlap = -gap;
    next = {axis, overlap};
  }
  return next;
}

// The next face to which the rounded normal slants, or else as far as it does itself.
FaceContacts::Edge FaceContacts::edge_of(const SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b,
                                         const btVector3& normal, const btVector3& slanted) const {
  if (const auto face = next_face(solids, pose_a, pose_b, normal)) return *face;
  btVector3 x, y;
  btPlaneSpace1(normal, x, y);
  const btVector3 across = (slanted - normal * normal.dot(slanted)).normalized();
  double of_a = BT_LARGE_FLOAT, of_b = -BT_LARGE_FLOAT;
  const auto along = [&](const Corner& corner) { return across.dot(x * corner.x + y * corner.y); };
  for (const Corner& corner : a_) of_a = std::min(of_a, along(corner));
  for (const Corner& corner : b_) of_b = std::max(of_b, along(corner));
  return {across, of_b - of_a};
}

const std::vector<FacePoint>& FaceContacts::find(const SolidPair& solids, const btTransform& pose_a,
                                                 const btTransform& pose_b, const btVector3& normal,
                                                 const ContactReach& near) {
  const double depth = near.depth;
  points_.clear();
  const ContactPlane plane(pose_b.getOrigin(), normal);
  const auto [is_whole_a, is_whole_b] = find_faces(solids, pose_a, pose_b, plane, depth);
  if (a_.empty() || b_.empty() || (a_.size() == 1 && b_.size() == 1)) return points_;
  const bool cuts_b = b_.size() < 3 && a_.size() > b_.size();  // a point or a line is cut by a face
  shared_ = cuts_b ? b_ : a_;
  const Face& other = cuts_b ? a_ : b_;
  if (shared_.size() == 1) {
    if (other.size() < 3 || !is_inside(other, shared_.front())) return points_;
  } else if (other.size() == 2) {
    if (const auto point = crossing(shared_, other)) {
      shared_ = {*point};
    } else {
      cut_to_line(shared_, scratch_, other);
    }
  } else {
    for (std::size_t i = 0; i < other.size(); ++i) cut(shared_, scratch_, other[i], other[(i + 1) % other.size()]);
  }
  if (near.compliant) straighten(shared_, scratch_, same_corner * depth);
  const double same = same_point * depth * same_point * depth;
  for (std::size_t i = 0; i < shared_.size(); ++i) {
    const Corner& corner = shared_[i];
    const auto is_same = [&](const Corner& before) { return squared_distance(before, corner) <= same; };
    if (std::any_of(shared_.begin(), shared_.begin() + static_cast<std::ptrdiff_t>(i), is_same)) continue;
    const double height_a = cuts_b ? height_at(a_, corner) : corner.height;
    const double height_b = cuts_b ? corner.height : height_at(b_, corner);
    if (height_a - height_b > near.reach()) continue;
    const btVector3 on_b = plane.origin + plane.x * corner.x + plane.y * corner.y + normal * height_b;
    points_.push_back({on_b, on_b, height_a - height_b});
  }
  if ((is_whole_a || is_whole_b) && points_.size() > 2) move_grips();
  return points_;
}

std::pair<bool, bool> FaceContacts::find_faces(const SolidPair& solids, const btTransform& pose_a,
                                               const btTransform& pose_b, const ContactPlane& plane, double depth) {
  const std::optional<Rim> rim_a = rim_of(solids.a(), pose_a, plane, -1.0);
  const std::optional<Rim> rim_b = rim_of(solids.b(), pose_b, plane, 1.0);
  if (!rim_a) find_face(solids.a(), pose_a, plane, -1.0, depth, a_, scratch_);
  if (!rim_b) find_face(solids.b(), pose_b, plane, 1.0, depth, b_, scratch_);
  const auto find = [&](const Rim& rim, double outward, const std::optional<Rim>& other, const Face& of_other,
                        Face& face) {
    angles_.clear();
    if (other) {
      add_crossings(rim, *other, angles_);
    } else if (of_other.size() > 1) {
      add_crossings(rim, of_other, angles_);
    }
    return find_rim(rim, outward, depth, other ? other->slope() : slope_of(of_other), angles_, face);
  };
  const bool is_whole_a = rim_a && find(*rim_a, -1.0, rim_b, b_, a_);
  const bool is_whole_b = rim_b && find(*rim_b, 1.0, rim_a, a_, b_);
  return {is_whole_a, is_whole_b};
}

// Corners beyond those of the faces come into contact before the next step where bodies turn as they hit each other.
void FaceContacts::add_corners(const SolidPair& solids, const btTransform& pose_a, const btTransform& pose_b,
                               const btVector3& normal, const ContactReach& near) {
  const ContactPlane plane(pose_b.getOrigin(), normal);
  find_face(solids.a(), pose_a, plane, -1.0, near.depth, a_, scratch_);
  find_face(solids.b(), pose_b, plane, 1.0, near.depth, b_, scratch_);
  const auto add = [&](const InnerShape& solid, const btTransform& pose, double outward, const Face& other) {
    if (other.size() < 3) return;
    const btVector3 direction = normal * outward * pose.getBasis();
    const auto [least, most] = extent(solid, direction);
    const double highest = most - std::min(near.depth, 0.5 * (most - least)), lowest = 0.5 * (least + most);
    for_each_corner(solid, direction, BT_LARGE_FLOAT, [&, highest = highest](const btVector3& point) {
      const double along = direction.dot(point);
      if (along >= highest || along < lowest) return;
      const Corner corner = plane(pose(point));
      if (!is_inside(other, corner)) return;
      const double height = height_at(other, corner), distance = outward * (height - corner.height);
      const btVector3 on_b = pose(point) + normal * (outward < 0.0 ? -distance : 0.0);
      if (distance <= near.early) points_.push_back({on_b, on_b, distance});
    });
  };
  add(solids.a(), pose_a, -1.0, b_);
  add(solids.b(), pose_b, 1.0, a_);
}

void FaceContacts::move_grips() {
  btVector3 center(0, 0, 0);
  for (const FacePoint& point : points_) center += point.on_b / static_cast<double>(points_.size());
  for (FacePoint& point : points_) point.grip = center + (point.on_b - center) * grip_share;
}

}  // namespace energymargin
