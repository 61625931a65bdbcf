#include "physics/contacts/face_contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace energymargin {
namespace {

using Corner = FaceContacts::Corner;
using Face = FaceContacts::Face;

constexpr double lying = 0.7;  // sine of the angle between a round solid's axis and the normal
constexpr int corners_of_a_rim = 8;
constexpr double parallel = 0.02;  // sine of the angle between two lines that lie on one another

// Shares of the depth.
constexpr double same_point = 1e-3;       // points so near are one
constexpr double same_corner = 1e-2;      // corners of a face so near are the ends of an edge along the normal
constexpr double straight_corner = 1e-6;  // a corner so near the line between its neighbours is none

// A flat face bears alone if it is more than this share of what is in reach.
constexpr double mostly = 0.5;

// Faces that are not flat may miss the deepest point, by more than this share of the margins.
constexpr double same_depth = 0.1;

// Shares of the margins.
constexpr double clearly_farther = 1e-6;  // along this axis, more than along another
constexpr double most_rounded = 0.74;     // that a sharp corner is nearer than a rounded one: sqrt 3 - 1
constexpr double least_overlap = 1e-2;    // of faces across an edge, of the smaller margin

// Cosines, of axes that are one, and of those of two faces with an edge between them.
constexpr double same_direction = 1.0 - 1e-11, across_an_edge = 0.7;

// Cosines between a normal and the faces that may have the right one.
constexpr double near_face = 0.5, any_face = -0.02;

// The plane of contact.
struct ContactPlane {
  btVector3 origin, x, y, normal;

  ContactPlane(const btVector3& through, const btVector3& along) : origin(through), normal(along) {
    btPlaneSpace1(normal, x, y);
  }

  Corner operator()(const btVector3& point) const {
    const btVector3 from = point - origin;
    return {x.dot(from), y.dot(from), normal.dot(from)};
  }
};

double cross(const Corner& from, const Corner& to, const Corner& point) {
  return (to.x - from.x) * (point.y - from.y) - (to.y - from.y) * (point.x - from.x);
}

double squared_distance(const Corner& a, const Corner& b) {
  return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
}

Corner between(const Corner& a, const Corner& b, double share) {
  return {a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.height + share * (b.height - a.height)};
}

// The corners of a circle of radius 1.
const std::array<btVector3, corners_of_a_rim> rim = [] {
  std::array<btVector3, corners_of_a_rim> corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const double angle = SIMD_2_PI * static_cast<double>(i) / corners_of_a_rim;
    corners[i] = btVector3(std::cos(angle), std::sin(angle), 0.0);
  }
  return corners;
}();

// Whether the corners of the other side are visited too: those of a thin plate are near.
bool has_back(const InnerShape& solid) { return solid.is_box() || solid.is_hull(); }

// Calls `visit` with the points that can be corners of a solid's outermost face along `direction`, in its frame.
template <typename Visit>
void for_each_corner(const InnerShape& solid, const btVector3& direction, const Visit& visit) {
  if (has_back(solid)) return solid.for_each_corner(visit);
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
  const double z = direction.z() < 0.0 ? -half.z() : half.z();
  for (const btVector3& corner : rim) visit(btVector3(half.x() * corner.x(), half.x() * corner.y(), z));
}

void sort(Face& face) {
  std::sort(face.begin(), face.end(),
            [](const Corner& a, const Corner& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
}

// Leaves of an edge along the normal its outer end. The corners are sorted, and stay so.
void merge(Face& face, Face& scratch, double outward, double near) {
  scratch.clear();
  bool moved = false;
  for (const Corner& corner : face) {
    auto before = scratch.rbegin();
    while (before != scratch.rend() && corner.x - before->x <= 2.0 * near &&
           squared_distance(*before, corner) > near * near) {
      ++before;
    }
    if (before == scratch.rend() || corner.x - before->x > 2.0 * near) {
      scratch.push_back(corner);
    } else if (outward * corner.height > outward * before->height) {
      *before = corner;
      moved = true;
    }
  }
  face.swap(scratch);
  if (moved) sort(face);
}

// Leaves the corners of the convex hull, in counter-clockwise order (Andrew 1979).
void order(Face& face, Face& scratch, double outward, double depth) {
  if (face.size() < 2) return;
  sort(face);
  merge(face, scratch, outward, same_corner * depth);
  if (face.size() < 3) return;
  scratch.clear();
  const double offset = straight_corner * depth;
  const auto turns_left = [&](const Corner& a, const Corner& b, const Corner& c) {
    const double twice_area = cross(a, b, c);
    return twice_area > 0.0 && twice_area * twice_area > offset * offset * squared_distance(a, c);
  };
  const auto add = [&](const Corner& corner, std::size_t first) {
    while (scratch.size() >= first + 2 && !turns_left(scratch[scratch.size() - 2], scratch.back(), corner)) {
      scratch.pop_back();
    }
    scratch.push_back(corner);
  };
  for (const Corner& corner : face) add(corner, 0);
  const std::size_t lower = scratch.size() - 1;
  for (auto corner = face.rbegin() + 1; corner != face.rend(); ++corner) add(*corner, lower);
  scratch.pop_back();
  face.swap(scratch);
}

double area(const Face& face) {
  double twice = 0.0;
  for (std::size_t i = 2; i < face.size(); ++i) twice += cross(face[0], face[i - 1], face[i]);
  return 0.5 * twice;
}

// How far a solid's corners reach along a direction in its frame, at least and at most.
std::pair<double, double> extent(const InnerShape& solid, const btVector3& direction) {
  std::pair<double, double> along(BT_LARGE_FLOAT, -BT_LARGE_FLOAT);
  for_each_corner(solid, direction, [&](const btVector3& point) {
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
  // A hull's corners may be as sharp as needles: they make its face as wide as it is, and no deeper than it is rounded.
  const double rounded = direction.dot(solid.support(direction)) + solid.margin();
  const double reached = solid.is_hull() ? std::min(most, rounded) : BT_LARGE_FLOAT;
  const double outside = solid.is_box() || solid.is_cylinder() || solid.is_hull() ? 0.0 : solid.margin();
  const auto add = [&](const btVector3& point) {
    const double along = direction.dot(point);
    if (along < most - depth) return;
    face.push_back(plane(pose(point)));
    face.back().height += outward * (std::min(along + outside, reached) - along);
  };
  for_each_corner(solid, direction, add);
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

// What of a face or a line is on the left of the line from `from` to `to`.
void cut(Face& face, Face& scratch, const Corner& from, const Corner& to) {
  scratch.clear();
  const std::size_t ends = face.size() == 2 ? 1 : face.size();  // a line has one edge
  if (face.size() == 2 && cross(from, to, face[0]) >= 0.0) scratch.push_back(face[0]);
  for (std::size_t i = 0; i < ends; ++i) {
    const Corner& a = face[i];
    const Corner& b = face[(i + 1) % face.size()];
    const double of_a = cross(from, to, a);
    const double of_b = cross(from, to, b);
    if ((of_a < 0.0) != (of_b < 0.0)) scratch.push_back(between(a, b, of_a / (of_a - of_b)));
    if (of_b >= 0.0) scratch.push_back(b);
  }
  face.swap(scratch);
}

// What of a line lies beside another one, unless they cross.
void cut_to_line(Face& line, Face& scratch, const Face& other) {
  const Corner& a = other[0];
  const Corner& b = other[1];
  const Corner along{b.x - a.x, b.y - a.y, 0.0};
  const Corner of_line{line[1].x - line[0].x, line[1].y - line[0].y, 0.0};
  const double sine = along.x * of_line.y - along.y * of_line.x;
  const Corner origin{0.0, 0.0, 0.0};
  if (sine * sine > parallel * parallel * squared_distance(origin, along) * squared_distance(origin, of_line)) {
    return line.clear();
  }
  const auto beside = [&](const Corner& end) { return Corner{end.x - along.y, end.y + along.x, 0.0}; };
  cut(line, scratch, beside(a), a);
  cut(line, scratch, b, beside(b));
}

// Leaves out corners that are nearer than `offset` to the line between their neighbours: edges that nearly lie on one
// another cross anywhere.
void straighten(Face& face, Face& scratch, double offset) {
  scratch.clear();
  for (std::size_t i = 0; i < face.size(); ++i) {
    const Corner& before = scratch.empty() ? face.back() : scratch.back();
    const Corner& first = scratch.empty() ? face.front() : scratch.front();
    const Corner& after = i + 1 < face.size() ? face[i + 1] : first;
    const double twice_area = cross(before, face[i], after);
    if (twice_area * twice_area > offset * offset * squared_distance(before, after)) scratch.push_back(face[i]);
  }
  if (scratch.size() > 2) face.swap(scratch);
}

bool is_inside(const Face& face, const Corner& point) {
  for (std::size_t i = 0; i < face.size(); ++i) {
    if (cross(face[i], face[(i + 1) % face.size()], point) < 0.0) return false;
  }
  return true;
}

// Height of a line or a face at a point of the plane.
double height_at(const Face& face, const Corner& point) {
  if (face.size() == 2) {
    const Corner& a = face[0];
    const Corner& b = face[1];
    const double share = ((point.x - a.x) * (b.x - a.x) + (point.y - a.y) * (b.y - a.y)) / squared_distance(a, b);
    return between(a, b, std::clamp(share, 0.0, 1.0)).height;
  }
  // Of the triangles from the first corner on, the first that the point is in, or the last one.
  for (std::size_t i = 1;; ++i) {
    const Corner& a = face[0];
    const Corner& b = face[i];
    const Corner& c = face[i + 1];
    if (i + 2 < face.size() && cross(a, c, point) > 0.0) continue;
    const double whole = cross(a, b, c);
    const double of_b = cross(a, point, c) / whole;
    const double of_c = cross(a, b, point) / whole;
    return a.height + of_b * (b.height - a.height) + of_c * (c.height - a.height);
  }
}

// A cylinder stands upright if its axis is as near to the vertical: square of the sine. Then its points stay where they
// are, and its lowest one is a thousandth of the radius below them at most.
constexpr double upright = 1e-6;

// Calls `visit` with every point of a solid that can be its lowest one along `down`, all in its own frame.
template <typename Visit>
void for_each_low_point(const InnerShape& solid, const btVector3& down, const Visit& visit) {
  const auto ends = [&](const btVector3& half, const btVector3& side) {
    visit(side + half);
    visit(side - half);
  };
  switch (solid.kind()) {
    case CYLINDER_SHAPE_PROXYTYPE: {
      // On each rim the lowest point and those a quarter and half a turn from it: a firm stand, and a smooth roll.
      const btVector3 half = solid.half() + btVector3(solid.margin(), solid.margin(), solid.margin());
      btVector3 low(down.x(), down.y(), 0.0);
      low = low.length2() > upright ? low.normalized() * half.x() : btVector3(half.x(), 0.0, 0.0);
      const btVector3 across(-low.y(), low.x(), 0.0);
      for (const btVector3& side : {low, -low, across, -across}) ends(btVector3(0.0, 0.0, half.z()), side);
      return;
    }
    case CAPSULE_SHAPE_PROXYTYPE:
      return ends(btVector3(0.0, 0.0, solid.half().z()), down * solid.margin());
    case SPHERE_SHAPE_PROXYTYPE:
      return visit(down * solid.margin());
    default:
      solid.for_each_corner(visit);
  }
}

// Half way from a solid's top to its lowest point, along `down`. A hull may have its frame anywhere.
double half_way(const InnerShape& solid, const btVector3& down) {
  if (!solid.is_hull()) return 0.0;
  double top = BT_LARGE_FLOAT;
  double low = -BT_LARGE_FLOAT;
  solid.for_each_corner([&](const btVector3& point) {
    top = std::min(top, down.dot(point));
    low = std::max(low, down.dot(point));
  });
  return 0.5 * (top + low);
}

// Whether a solid is a cylinder on its round face.
bool stands(const InnerShape& solid, const btVector3& down) {
  return solid.is_cylinder() && down.x() * down.x() + down.y() * down.y() <= upright;
}

}  // namespace

const std::vector<FacePoint>& FaceContacts::contacts(SolidPair& solids, const btTransform& pose_a,
                                                     const btTransform& pose_b, const ContactReach& near,
                                                     btVector3& normal) {
  points_.clear();
  edge_.reset();
  const double rounded = solids.have_edges() ? most_rounded * solids.margins() : 0.0;
  if (const auto closest = solids.closest(pose_a, pose_b, near.reach() + rounded)) {
    normal = closest->normal;
    find_sharp(solids, pose_a, pose_b, *closest, near, normal);
    if (near.early > 0.0 && !points_.empty()) add_corners(solids, pose_a, pose_b, normal, near);
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
  } else if (points_.size() > 1) {
    if (axis) {  // between edges: no nearer than rounded ones
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
  find_face(solids.a(), pose_a, plane, -1.0, depth, a_, scratch_);
  find_face(solids.b(), pose_b, plane, 1.0, depth, b_, scratch_);
  if (a_.size() < 2 || b_.size() < 2) return points_;
  const bool round = a_.size() == corners_of_a_rim && solids.a().is_cylinder();
  const bool other_round = b_.size() == corners_of_a_rim && solids.b().is_cylinder();
  const bool cuts_b = b_.size() == 2 && a_.size() > 2;  // a line is cut by a face
  shared_ = cuts_b ? b_ : a_;
  const Face& other = cuts_b ? a_ : b_;
  if (other.size() == 2) {
    cut_to_line(shared_, scratch_, other);
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
  if ((round || other_round) && points_.size() > 2) move_grips();
  return points_;
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
    for_each_corner(solid, direction, [&, highest = highest](const btVector3& point) {
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

void find_plane_contacts(const InnerShape& solid, const btTransform& pose, const WorldPlane& plane, double reach,
                         std::vector<FacePoint>& points) {
  points.clear();
  const btVector3 down = -plane.normal * pose.getBasis();
  const bool rubs_inside = stands(solid, down);
  const double middle = half_way(solid, down);
  for_each_low_point(solid, down, [&](const btVector3& point) {
    if (down.dot(point) < middle) return;  // the top of a thin body is in reach too, and must not carry it
    const btVector3 on_solid = pose * point;
    const double distance = plane.normal.dot(on_solid) - plane.offset;
    if (distance >= reach) return;
    const btVector3 on_plane = on_solid - plane.normal * distance;
    points.push_back({on_plane, on_plane, distance});
    if (!rubs_inside) return;
    const btVector3 grip = pose * btVector3(grip_share * point.x(), grip_share * point.y(), point.z());
    points.back().grip = grip - plane.normal * distance;
  });
}

}  // namespace energymargin
