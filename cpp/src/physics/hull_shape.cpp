#include "physics/hull_shape.hpp"

#include <LinearMath/btConvexHullComputer.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <numeric>
#include <set>
#include <utility>

#include "scene/body_constants.hpp"

namespace energymargin {
namespace {

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
