#include "physics/contacts/face_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/portable.hpp"
#include "physics/contacts/patches.hpp"

namespace energymargin {

// The plane of contact.
struct ContactPlane {
  btVector3 origin, x, y, normal;

  ContactPlane(const btVector3& through, const btVector3& along) : origin(through), normal(along) {
    btPlaneSpace1(normal, x, y);
  }

  FaceContacts::Corner operator()(const btVector3& point) const {
    const btVector3 from = point - origin;
    return {x.dot(from), y.dot(from), normal.dot(from)};
  }
};

namespace {

using Corner = FaceContacts::Corner;
using Face = FaceContacts::Face;

constexpr double lying = 0.7;         // sine of the angle between a round solid's axis and the normal
constexpr double least_tilt = 1e-10;  // sine, of which rounding leaves the direction
constexpr double parallel = 0.02;     // sine of the angle between two lines that lie on one another
constexpr double same_angle = 1e-6;   // rad, on a rim: points so near are one

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
constexpr double least_overlap = 1e-2;    // of faces across an edge, of the smaller margin

// Cosines, of axes that are one, and of those of two faces with an edge between them.
constexpr double same_direction = 1.0 - 1e-11, across_an_edge = 0.7;

// Cosines between a normal and the faces that may have the right one.
constexpr double near_face = 0.5, any_face = -0.02;

double cross(const Corner& from, const Corner& to, const Corner& point) {
  return (to.x - from.x) * (point.y - from.y) - (to.y - from.y) * (point.x - from.x);
}

double squared_distance(const Corner& a, const Corner& b) {
  return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
}

Corner between(const Corner& a, const Corner& b, double share) {
  return {a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.height + share * (b.height - a.height)};
}

// Calls `visit` with the corners of a cylinder's rim, of which one is the lowest along `down` in its frame, at a
// height.
template <typename Visit>
void for_each_rim_corner(double radius, double z, const btVector3& down, const Visit& visit) {
  const double across = std::hypot(down.x(), down.y());
  const btVector3 low =
      across > least_tilt ? btVector3(down.x(), down.y(), 0.0) * (radius / across) : btVector3(radius, 0.0, 0.0);
  const btVector3 aside(-low.y(), low.x(), 0.0), height(0.0, 0.0, z);
  for (const double sign : {1.0, -1.0}) {
    visit(sign * low + height);
    visit(sign * aside + height);
    visit(SIMDSQRT12 * sign * (low + aside) + height);
    visit(SIMDSQRT12 * sign * (low - aside) + height);
  }
}

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
  // A hull's corners may be as sharp as needles: they make its face as wide as it is, and no deeper than it is rounded.
  const double reached = BT_LARGE_FLOAT;
  const double outside = has_back(solid) || solid.is_cylinder() ? 0.0 : solid.margin();
  const auto add = [&](const btVector3& point) {
    const double along = direction.dot(point);
    if (along < most - depth) return;
    face.push_back(plane(pose(point)));
    face.back().height += outward * (std::min(along + outside, reached) - along);
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

// How a face rises along the plane of contact.
struct Slope {
  double x = 0.0, y = 0.0;
};

Slope slope_of(const Face& face) {
  btVector3 normal(0.0, 0.0, 0.0);
  for (std::size_t i = 2; i < face.size(); ++i) {
    const auto from_first = [&](std::size_t k) {
      return btVector3(face[k].x - face[0].x, face[k].y - face[0].y, face[k].height - face[0].height);
    };
    normal += from_first(i - 1).cross(from_first(i));
  }
  return normal.z() > 0.0 ? Slope{-normal.x() / normal.z(), -normal.y() / normal.z()} : Slope{};
}

// The circle around a cylinder's end: center + cos x + sin y.
struct Rim {
  Corner center, x, y;

  Corner at(double angle) const {
    const double cosine = portable::cos(angle), sine = portable::sin(angle);
    return {center.x + cosine * x.x + sine * y.x, center.y + cosine * x.y + sine * y.y,
            center.height + cosine * x.height + sine * y.height};
  }

  // The same, with the circle as unit circle.
  std::pair<double, double> scaled(const Corner& point) const {
    const double whole = x.x * y.y - x.y * y.x, of_x = point.x - center.x, of_y = point.y - center.y;
    return {(of_x * y.y - of_y * y.x) / whole, (x.x * of_y - x.y * of_x) / whole};
  }

  bool is_clockwise() const { return x.x * y.y < x.y * y.x; }
  double radius() const { return std::sqrt(x.x * x.x + x.y * x.y + x.height * x.height); }
  Slope slope() const {
    const double whole = x.x * y.y - x.y * y.x;
    return {(x.height * y.y - y.height * x.y) / whole, (x.x * y.height - y.x * x.height) / whole};
  }
};

// That of the end that faces `outward` along the normal, unless the cylinder lies on its side.
std::optional<Rim> rim_of(const InnerShape& solid, const btTransform& pose, const ContactPlane& plane, double outward) {
  if (!solid.is_cylinder()) return std::nullopt;
  const btVector3 direction = plane.normal * outward * pose.getBasis();
  if (std::hypot(direction.x(), direction.y()) > lying) return std::nullopt;
  const double radius = solid.half().x() + solid.margin(), z = solid.half().z() + solid.margin();
  const auto along = [&](const btVector3& arm) {
    return Corner{plane.x.dot(arm), plane.y.dot(arm), plane.normal.dot(arm)};
  };
  return Rim{plane(pose(btVector3(0.0, 0.0, direction.z() < 0.0 ? -z : z))),
             along(pose.getBasis().getColumn(0) * radius), along(pose.getBasis().getColumn(1) * radius)};
}

// Where a circle crosses the edges of a face or a line.
void add_crossings(const Rim& rim, const Face& other, std::vector<double>& angles) {
  for (std::size_t i = other.size() == 2 ? 1 : 0; i < other.size(); ++i) {
    const auto [from_x, from_y] = rim.scaled(other[i]);
    const auto [to_x, to_y] = rim.scaled(other[(i + 1) % other.size()]);
    const double along_x = to_x - from_x, along_y = to_y - from_y, square = along_x * along_x + along_y * along_y;
    const double half = from_x * along_x + from_y * along_y;
    const double root = half * half - square * (from_x * from_x + from_y * from_y - 1.0);
    if (!(root > 0.0 && square > 0.0)) continue;
    for (const double sign : {-1.0, 1.0}) {
      const double share = (sign * std::sqrt(root) - half) / square;
      if (share < 0.0 || share > 1.0) continue;
      angles.push_back(portable::atan2(from_y + share * along_y, from_x + share * along_x));
    }
  }
}

// Where it crosses another circle.
void add_crossings(const Rim& rim, const Rim& other, std::vector<double>& angles) {
  const auto [x, y] = rim.scaled(other.center);
  const double away = std::hypot(x, y), ratio = other.radius() / rim.radius();
  if (!(away > std::abs(1.0 - ratio) && away < 1.0 + ratio)) return;
  const double half = portable::acos((1.0 + away * away - ratio * ratio) / (2.0 * away));
  angles.push_back(portable::atan2(y, x) + half);
  angles.push_back(portable::atan2(y, x) - half);
}

// The corners of a rim within `depth` of its outermost one: it bears where its circle does, so they are at eighths of a
// turn from where it is nearest to a face of that slope, however little nearer, and at `angles`. Whether all are.
bool find_rim(const Rim& rim, double outward, double depth, const Slope& other, std::vector<double>& angles,
              Face& face) {
  const double x = rim.x.height - other.x * rim.x.x - other.y * rim.x.y;
  const double y = rim.y.height - other.x * rim.y.x - other.y * rim.y.y;
  const double nearest = std::hypot(x, y) > least_tilt * rim.radius() ? portable::atan2(outward * y, outward * x) : 0.0;
  for (int eighth = 0; eighth < 8; ++eighth) angles.push_back(nearest + SIMD_2_PI / 8.0 * eighth);
  for (double& angle : angles) angle -= SIMD_2_PI * std::floor((angle - nearest) / SIMD_2_PI);
  std::sort(angles.begin(), angles.end());
  const auto is_same = [](double angle, double next) { return next - angle < same_angle; };
  angles.erase(std::unique(angles.begin(), angles.end(), is_same), angles.end());
  if (angles.front() + SIMD_2_PI - angles.back() < same_angle) angles.pop_back();
  if (rim.is_clockwise()) std::reverse(angles.begin(), angles.end());
  const double most = outward * rim.center.height + std::hypot(rim.x.height, rim.y.height);
  face.clear();
  for (const double angle : angles) {
    const Corner corner = rim.at(angle);
    if (outward * corner.height >= most - depth) face.push_back(corner);
  }
  return face.size() == angles.size();
}

// Where two lines cross, if they do and are not parallel.
std::optional<Corner> crossing(const Face& line, const Face& other) {
  const double along_x = line[1].x - line[0].x, along_y = line[1].y - line[0].y;
  const double other_x = other[1].x - other[0].x, other_y = other[1].y - other[0].y;
  const double sine = along_x * other_y - along_y * other_x;
  const double lengths = squared_distance(line[0], line[1]) * squared_distance(other[0], other[1]);
  if (!(sine * sine > parallel * parallel * lengths)) return std::nullopt;
  const double from_x = other[0].x - line[0].x, from_y = other[0].y - line[0].y;
  const double share = (from_x * other_y - from_y * other_x) / sine;
  const double of_other = (from_x * along_y - from_y * along_x) / sine;
  if (share < 0.0 || share > 1.0 || of_other < 0.0 || of_other > 1.0) return std::nullopt;
  return between(line[0], line[1], share);
}

// A cylinder stands upright if its axis is as near to the vertical: square of the sine.
constexpr double upright = 1e-6;

// Of heights above a plane, a share of the coordinates that they come from: more than there is.
constexpr double rounding_of_heights = 1e-12;

// Calls `visit` with every point of a solid that can be its lowest one along `down`, all in its own frame; of a hull
// with those that can be within `depth` of it [m].
template <typename Visit>
void for_each_low_point(const InnerShape& solid, const btVector3& down, double depth, const Visit& visit) {
  const auto ends = [&](const btVector3& half, const btVector3& side) {
    visit(side + half);
    visit(side - half);
  };
  switch (solid.kind()) {
    case CYLINDER_SHAPE_PROXYTYPE: {
      // On each rim the lowest point, however little it is lower, and those eighths of a turn from it: a stand that
      // tips where its circle does, and a smooth roll.
      const btVector3 half = solid.half() + btVector3(solid.margin(), solid.margin(), solid.margin());
      for (const double z : {half.z(), -half.z()}) for_each_rim_corner(half.x(), z, down, visit);
      return;
    }
    case CAPSULE_SHAPE_PROXYTYPE:
      return ends(btVector3(0.0, 0.0, solid.half().z()), down * solid.margin());
    case SPHERE_SHAPE_PROXYTYPE:
      return visit(down * solid.margin());
    default:
      solid.for_each_corner_near(down, depth, visit);
  }
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

void find_plane_contacts(const InnerShape& solid, const btTransform& pose, const WorldPlane& plane, double reach,
                         std::vector<FacePoint>& points) {
  points.clear();
  const btVector3 down = -plane.normal * pose.getBasis();
  const bool rubs_inside = stands(solid, down);
  double middle = 0.0, depth = BT_LARGE_FLOAT;
  if (solid.is_hull()) {  // its frame may be anywhere
    const auto [top, low] = extent(solid, down);
    const double height = plane.normal.dot(pose.getOrigin()) - plane.offset - low;
    middle = 0.5 * (top + low);
    depth = reach - height + rounding_of_heights * (std::abs(plane.offset) + pose.getOrigin().length() + std::abs(low));
    if (depth < 0.0) return;
  }
  for_each_low_point(solid, down, depth, [&](const btVector3& point) {
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
