#include "physics/shapes.hpp"

#include <LinearMath/btConvexHullComputer.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <set>
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

// Of a sliver less than was asked for can be taken off, or nothing.
constexpr int most_halvings = 8;

double shrink(const std::vector<Vector3>& points, double margin, btConvexHullComputer& inner) {
  const auto compute = [&](double asked) {
    return inner.compute(points.front().data(), sizeof(Vector3), static_cast<int>(points.size()), asked, 0.5);
  };
  for (int i = 0; i < most_halvings; ++i, margin *= 0.5) {
    const double shrunk = compute(margin);
    if (shrunk >= 0.0 && inner.vertices.size() > 0) return shrunk;
  }
  return compute(0.0);
}

// The corners of a face, in its order.
std::vector<std::size_t> corners_of(const btConvexHullComputer& hull, int face) {
  std::vector<std::size_t> corners;
  const btConvexHullComputer::Edge* const first = &hull.edges[hull.faces[face]];
  const btConvexHullComputer::Edge* edge = first;
  do {
    corners.push_back(static_cast<std::size_t>(edge->getSourceVertex()));
    edge = edge->getNextEdgeOfFace();
  } while (edge != first);
  return corners;
}

// A face of a hull: normal . x = offset.
struct HullFace {
  Vector3 normal;
  double offset, area;
  std::vector<std::size_t> corners;  // of the hull
};

// The faces of a hull with these corners.
std::vector<HullFace> faces_of(const btConvexHullComputer& hull, const std::vector<Vector3>& corners) {
  const Vector3 middle =
      std::accumulate(corners.begin(), corners.end(), Vector3(Vector3::Zero())) / static_cast<double>(corners.size());
  std::vector<HullFace> faces;
  for (int face = 0; face < hull.faces.size(); ++face) {
    HullFace made{Vector3::Zero(), 0.0, 0.0, corners_of(hull, face)};
    const Vector3& from = corners[made.corners.front()];
    for (std::size_t i = 2; i < made.corners.size(); ++i) {
      made.normal += (corners[made.corners[i - 1]] - from).cross(corners[made.corners[i]] - from);
    }
    made.area = 0.5 * made.normal.norm();
    if (!(made.area > 0.0)) continue;
    made.normal.normalize();
    if (made.normal.dot(from - middle) < 0.0) made.normal = -made.normal;
    made.offset = made.normal.dot(from);
    for (const std::size_t i : made.corners) made.offset = std::max(made.offset, made.normal.dot(corners[i]));
    faces.push_back(made);
  }
  return faces;
}

// Puts a vertex of a hull that shrank by its margin on the faces that it belongs to, the largest first, as far as these
// are not nearly parallel, nor farther than rounding makes them.
Vector3 on_faces(const Vector3& vertex, std::vector<const HullFace*> faces, double margin, double near) {
  constexpr double apart = 0.1;  // sine of the angle between a face and those before
  std::stable_sort(faces.begin(), faces.end(), [](const HullFace* a, const HullFace* b) { return a->area > b->area; });
  Eigen::Matrix3d left = Eigen::Matrix3d::Identity();  // along which no face holds the vertex yet
  Vector3 at = vertex;
  for (const HullFace* face : faces) {
    if (std::abs(face->offset - margin - face->normal.dot(vertex)) > near) continue;
    const Vector3 along = left * face->normal;
    const double square = along.squaredNorm();
    if (square < apart * apart) continue;
    at += along * ((face->offset - margin - face->normal.dot(at)) / square);
    left -= along * along.transpose() / square;
  }
  return at;
}

// The vertices of a hull that shrank by `margin`. Bullet rounds them, so that what is flat leans: here they are where
// the faces of the hull are, less the margin.
std::vector<Vector3> exact_vertices(const btConvexHullComputer& inner, const std::vector<HullFace>& faces,
                                    double margin, double near) {
  std::vector<Vector3> vertices;
  for (int i = 0; i < inner.vertices.size(); ++i) vertices.push_back(from_bullet(inner.vertices[i]));
  std::vector<std::vector<const HullFace*>> of_vertex(vertices.size());
  if (faces.empty()) return vertices;
  for (const HullFace& shrunk : faces_of(inner, vertices)) {
    const HullFace& face = *std::max_element(faces.begin(), faces.end(), [&](const HullFace& a, const HullFace& b) {
      return a.normal.dot(shrunk.normal) < b.normal.dot(shrunk.normal);
    });
    for (const std::size_t i : shrunk.corners) of_vertex[i].push_back(&face);
  }
  for (std::size_t i = 0; i < vertices.size(); ++i) vertices[i] = on_faces(vertices[i], of_vertex[i], margin, near);
  return vertices;
}

std::vector<HullShape::Face> flat_faces(const std::vector<HullFace>& faces, const std::vector<Vector3>& corners) {
  constexpr double nearly_parallel = 0.9998;  // cosine of 0.02 rad
  std::vector<HullShape::Face> found;
  for (const HullFace& face : faces) {
    HullShape::Face& made = found.emplace_back(HullShape::Face{to_bullet(face.normal), -BT_LARGE_FLOAT});
    std::set<std::size_t> indices;
    for (const HullFace& other : faces) {
      if (other.normal.dot(face.normal) < nearly_parallel) continue;
      made.area += other.area;
      indices.insert(other.corners.begin(), other.corners.end());
    }
    for (const std::size_t i : indices) made.corners.push_back(to_bullet(corners[i]));
    for (const Vector3& corner : corners) made.offset = std::max(made.offset, face.normal.dot(corner));
  }
  return found;
}

// A hull with its margin inside.
HullShape::Hull shrunk_hull(const std::vector<Vector3>& points, double margin) {
  constexpr double near = 1e-3;  // of Bullet's vertices, a share of the hull's size
  btConvexHullComputer inner, whole;
  HullShape::Hull hull;
  hull.margin = shrink(points, margin, inner);
  whole.compute(points.front().data(), sizeof(Vector3), static_cast<int>(points.size()), 0.0, 0.0);
  std::vector<Vector3> corners;
  Eigen::AlignedBox3d box;
  for (int i = 0; i < whole.vertices.size(); ++i) {
    corners.push_back(points[static_cast<std::size_t>(whole.original_vertex_index[i])]);
    box.extend(corners.back());
    hull.corners.push_back(to_bullet(corners.back()));
  }
  const std::vector<HullFace> faces = faces_of(whole, corners);
  for (const Vector3& vertex : exact_vertices(inner, faces, hull.margin, near * box.sizes().maxCoeff())) {
    hull.inner.push_back(to_bullet(vertex));
  }
  hull.faces = flat_faces(faces, corners);
  return hull;
}

constexpr std::size_t few_points = 16;  // which are looked at sooner than their table
constexpr double near_corners = 0.05;   // of a hull's size: where the corners of its face are mostly asked for

constexpr double one_normal_depth = 2e-9;  // of unit vectors along a face's normal

// Half the diagonal of the box around points [m].
double extent_of(const std::vector<btVector3>& points) {
  btVector3 low = points.front(), high = low;
  for (const btVector3& point : points) {
    low.setMin(point);
    high.setMax(point);
  }
  return 0.5 * (high - low).length();
}

std::vector<btVector3> normals_of(const std::vector<HullShape::Face>& faces) {
  std::vector<btVector3> normals;
  for (const HullShape::Face& face : faces) normals.push_back(face.normal);
  return normals;
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

HullShape::HullShape(const std::vector<Vector3>& points, double margin) : HullShape(shrunk_hull(points, margin)) {}

HullShape::HullShape(const Hull& hull)
    : corners_(hull.corners),
      faces_(hull.faces),
      points_(hull.inner),
      corner_points_(hull.corners, near_corners * extent_of(hull.corners)),
      normals_(normals_of(hull.faces), one_normal_depth),
      low_(hull.corners.front()),
      high_(low_) {
  for (const btVector3& point : hull.inner) addPoint(point, false);
  recalcLocalAabb();
  setMargin(hull.margin);
  for (const btVector3& corner : corners_) {
    low_.setMin(corner);
    high_.setMax(corner);
  }
}

PointSet::PointSet(const std::vector<btVector3>& points, double depth)
    : count_(points.size()), blocks_((points.size() + block - 1) / block), depth_(depth) {
  for (std::size_t i = 0; i < block * blocks_.size(); ++i) {
    const btVector3& point = points[std::min(i, points.size() - 1)];
    Block& of = blocks_[i / block];
    const std::size_t pair = i % block / 2;
    of.x[pair][i % 2] = point.x();
    of.y[pair][i % 2] = point.y();
    of.z[pair][i % 2] = point.z();
  }
}

const DirectionTable& PointSet::make_table() const {
  static std::mutex making;
  const std::lock_guard<std::mutex> alone(making);
  const DirectionTable* made = table_.load(std::memory_order_acquire);
  if (made) return *made;
  std::vector<btVector3> points;
  for (std::size_t i = 0; i < count_; ++i) points.push_back(point(i));
  made = count_ < few_points ? new DirectionTable : new DirectionTable(points, depth_);
  table_.store(made, std::memory_order_release);
  return *made;
}

btVector3 PointSet::point(std::size_t i) const {
  const Block& of = blocks_[i / block];
  const std::size_t pair = i % block / 2, lane = i % 2;
  return {of.x[pair][lane], of.y[pair][lane], of.z[pair][lane]};
}

double PointSet::along(std::size_t i, const btVector3& direction) const {
  const btVector3 at = point(i);
  return at.x() * direction.x() + at.y() * direction.y() + at.z() * direction.z();
}

Pair PointSet::along(const Block& of, std::size_t pair, const btVector3& direction) {
  return of.x[pair] * direction.x() + of.y[pair] * direction.y() + of.z[pair] * direction.z();
}

std::size_t PointSet::farthest_of(const DirectionTable::Candidates& candidates, const btVector3& direction) const {
  std::size_t first = *candidates.first;
  double most = along(first, direction);
  for (const DirectionTable::Index* i = candidates.first + 1; i != candidates.last; ++i) {
    const double now = along(*i, direction);
    first = now > most ? std::size_t{*i} : first;
    most = now > most ? now : most;
  }
  return first;
}

std::pair<double, double> PointSet::extent(const btVector3& direction) const {
  const DirectionTable::Candidates ahead = table().at(direction), behind = table().at(-direction);
  if (!ahead.empty() && !behind.empty())
    return {along(farthest_of(behind, -direction), direction), along(farthest_of(ahead, direction), direction)};
  Pair least[pairs], most[pairs];
  for (std::size_t pair = 0; pair < pairs; ++pair) least[pair] = most[pair] = along(blocks_[0], pair, direction);
  for (std::size_t i = 1; i < blocks_.size(); ++i) {
    for (std::size_t pair = 0; pair < pairs; ++pair) {
      const Pair now = along(blocks_[i], pair, direction);
      least[pair] = now < least[pair] ? now : least[pair];
      most[pair] = now > most[pair] ? now : most[pair];
    }
  }
  std::pair<double, double> extent = {double{least[0][0]}, double{most[0][0]}};
  for (std::size_t lane = 1; lane < block; ++lane) {
    extent.first = std::min(extent.first, least[lane / 2][lane % 2]);
    extent.second = std::max(extent.second, most[lane / 2][lane % 2]);
  }
  return extent;
}

std::size_t PointSet::farthest_of_all(const btVector3& direction) const {
  using Places = long long __attribute__((vector_size(sizeof(Pair))));
  Pair most[pairs];
  Places best[pairs] = {}, place = {};
  for (std::size_t pair = 0; pair < pairs; ++pair) most[pair] = along(blocks_[0], pair, direction);
  for (std::size_t i = 1; i < blocks_.size(); ++i) {
    place += block;
    for (std::size_t pair = 0; pair < pairs; ++pair) {
      const Pair now = along(blocks_[i], pair, direction);
      const Places farther = now > most[pair];
      most[pair] = farther ? now : most[pair];
      best[pair] = farther ? place : best[pair];
    }
  }
  double farthest = most[0][0];
  long long first = best[0][0];
  for (std::size_t lane = 1; lane < block; ++lane) {
    const double now = most[lane / 2][lane % 2];
    const long long point = best[lane / 2][lane % 2] + static_cast<long long>(lane);
    if (!(now > farthest || (now == farthest && point < first))) continue;
    farthest = now;
    first = point;
  }
  return static_cast<std::size_t>(first);
}

void HullShape::getAabb(const btTransform& pose, btVector3& low, btVector3& high) const {
  btTransformAabb(low_, high_, 0.0, pose, low, high);
}

// Bullet's exact hull computer.
std::vector<std::array<std::size_t, 3>> hull_faces(const std::vector<Vector3>& points) {
  btConvexHullComputer hull;
  hull.compute(points.front().data(), sizeof(Vector3), static_cast<int>(points.size()), 0.0, 0.0);
  const auto vertex = [&](std::size_t i) {
    return static_cast<std::size_t>(hull.original_vertex_index[static_cast<int>(i)]);
  };
  std::vector<std::array<std::size_t, 3>> triangles;
  for (int face = 0; face < hull.faces.size(); ++face) {
    const std::vector<std::size_t> corners = corners_of(hull, face);
    for (std::size_t i = 2; i < corners.size(); ++i) {
      triangles.push_back({vertex(corners[0]), vertex(corners[i - 1]), vertex(corners[i])});
    }
  }
  return triangles;
}

}  // namespace energymargin
