#include "physics/contacts/solid_pair.hpp"

#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>

#include <algorithm>
#include <cmath>

namespace energymargin {
namespace {

// Axes are parallel up to this angle [rad]: a cylinder tilted so is a circle to a ten-thousandth.
constexpr double along_tilt = 0.01;

// The points are at an end of the common height where that is so much closer than the other [m], and between them
// before. Of cylinders that cross, they are at the lowest point of a parabola through both ends and the middle.
constexpr double clearly_closer = 1e-5;

// Two ways to find a distance agree if they differ by less than this share of the margins.
constexpr double same_distance = 1e-9;

// Shares of the size.
constexpr double proven_depth = 1e-7;
constexpr double least_apart = 1e-3;

// The nearest point of a box or a cylinder to one beside it, across `axis`, in its own frame.
btVector3 nearest_across(const InnerShape& shape, int axis, btVector3 point) {
  point[axis] = 0.0;
  const btVector3& half = shape.half();
  if (shape.is_cylinder()) return point * (half.x() / point.length());
  for (int i = 0; i < 3; ++i) point[i] = std::clamp(point[i], -half[i], half[i]);
  return point;
}

// `a` is a cylinder, `b` a box or a cylinder; in the frame of b.
struct Beside {
  const InnerShape &a, &b;
  btVector3 center, along;  // of a, and its axis
  int axis;                 // of b, that is parallel

  btVector3 on_axis(double height) const { return center + along * ((height - center[axis]) / along[axis]); }

  btVector3 on_b(const btVector3& beside) const {
    btVector3 point = nearest_across(b, axis, beside);
    point[axis] = beside[axis];
    return point;
  }

  double distance(double height) const {
    const btVector3 point = on_axis(height);
    return (point - on_b(point)).length() - a.half().x();
  }

  bool is_inside(const btVector3& point) const {
    const double radius = b.half().x();
    return b.is_cylinder() && point.x() * point.x() + point.y() * point.y() <= radius * radius;
  }
};

std::optional<ClosestPoints> beside(const InnerShape& a, const btTransform& pose_a, const InnerShape& b,
                                    const btTransform& pose_b) {
  const btVector3 along = pose_a.getBasis().getColumn(2) * pose_b.getBasis();
  const int axis = b.is_cylinder() ? 2 : along.absolute().maxAxis();
  if (1.0 - std::abs(along[axis]) > 0.5 * along_tilt * along_tilt) return std::nullopt;
  const Beside pair{a, b, (pose_a.getOrigin() - pose_b.getOrigin()) * pose_b.getBasis(), along, axis};
  const double low = std::max(pair.center[axis] - a.half().z(), -b.half()[axis]);
  const double high = std::min(pair.center[axis] + a.half().z(), b.half()[axis]);
  if (low >= high) return std::nullopt;
  const double at_low = pair.distance(low), at_high = pair.distance(high);
  const double bend = 2.0 * (at_low + at_high - 2.0 * pair.distance(0.5 * (low + high)));
  const double share = 0.5 + 0.5 * std::clamp((at_low - at_high) / std::max(bend, clearly_closer), -1.0, 1.0);
  const btVector3 on_axis = pair.on_axis(low + share * (high - low));
  const btVector3 on_b = pair.on_b(on_axis);
  btVector3 away = on_axis - on_b;
  const double distance = away.length() - a.half().x();
  if (pair.is_inside(on_axis) || !(distance >= clearly_apart(a, b))) return std::nullopt;
  return ClosestPoints{pose_b.getBasis() * away.normalized(), pose_b(on_b), distance};
}

// Shares of a squared distance, below which a step is none: round solids may take long to get to the first.
constexpr double no_closer = 1e-14, hardly_closer = 1e-9;
constexpr int most_fine_iterations = 30;
constexpr double flat = 1e-16;  // square of the sine, below which four vertices lie in one plane
constexpr int most_iterations = 100;

// A vertex of the simplex: a point of a less a point of b.
struct Vertex {
  btVector3 difference;
  btVector3 on_a, on_b;  // in the shapes' own frames
  double weight = 0.0;   // of it in the closest point
};

// Those of a simplex that carry the point closest to the origin, and their weights in it; none if the origin is inside.
struct Weights {
  int count = 0;
  int which[3] = {};
  double weights[3] = {};
};

// Up to four vertices, of which those stay that carry the point closest to the origin (Ericson 2005, section 5.1).
class Simplex {
 public:
  void add(const Vertex& vertex) { vertices_[count_++] = vertex; }
  int count() const { return count_; }
  const Vertex& operator[](int i) const { return vertices_[i]; }

  // Leaves the vertices that carry the point; false if the origin is inside.
  bool reduce() { return keep(weights()); }

  // Adds a vertex and reduces; false if the origin is inside. What is too flat for that leads no closer than `squared`,
  // or seems to have the origin inside though it is known to be outside: then to the line to the vertex.
  bool extend(const Vertex& next, double squared, bool is_outside) {
    vertices_[count_++] = next;
    const Weights found = weights();
    if (found.count == 0 && !is_outside) return false;
    if (found.count > 0 && closest(found).length2() < squared) return keep(found);
    --count_;
    vertices_[0] = {closest(), sum(&Vertex::on_a), on_b()};
    vertices_[1] = next;
    count_ = 2;
    return reduce();
  }

  btVector3 closest() const { return sum(&Vertex::difference); }
  btVector3 on_b() const { return sum(&Vertex::on_b); }

 private:
  btVector3 sum(btVector3 Vertex::* of) const {
    btVector3 total(0.0, 0.0, 0.0);
    for (int i = 0; i < count_; ++i) total += vertices_[i].weight * (vertices_[i].*of);
    return total;
  }

  const btVector3& at(int i) const { return vertices_[i].difference; }

  btVector3 closest(const Weights& of) const {
    btVector3 total(0.0, 0.0, 0.0);
    for (int i = 0; i < of.count; ++i) total += of.weights[i] * at(of.which[i]);
    return total;
  }

  bool keep(const Weights& of) {
    Vertex kept[3];
    for (int i = 0; i < of.count; ++i) {
      kept[i] = vertices_[of.which[i]];
      kept[i].weight = of.weights[i];
    }
    std::copy_n(kept, of.count, vertices_);
    count_ = of.count;
    return count_ > 0;
  }

  Weights weights() const {
    switch (count_) {
      case 1:
        return {1, {0}, {1.0}};
      case 2:
        return of_line(0, 1);
      case 3:
        return of_triangle(0, 1, 2);
      default:
        return of_tetrahedron();
    }
  }

  Weights of_line(int a, int b) const {
    const btVector3 along = at(b) - at(a);
    const double share = -at(a).dot(along);
    const double length = along.length2();
    if (share <= 0.0) return {1, {a}, {1.0}};
    if (share >= length) return {1, {b}, {1.0}};
    return {2, {a, b}, {1.0 - share / length, share / length}};
  }

  Weights of_triangle(int a, int b, int c) const {
    const btVector3 ab = at(b) - at(a);
    const btVector3 ac = at(c) - at(a);
    const double a_b = -ab.dot(at(a)), a_c = -ac.dot(at(a));
    if (a_b <= 0.0 && a_c <= 0.0) return {1, {a}, {1.0}};
    const double b_b = -ab.dot(at(b)), b_c = -ac.dot(at(b));
    if (b_b >= 0.0 && b_c <= b_b) return {1, {b}, {1.0}};
    const double c_b = -ab.dot(at(c)), c_c = -ac.dot(at(c));
    if (c_c >= 0.0 && c_b <= c_c) return {1, {c}, {1.0}};
    const double of_c = a_b * b_c - b_b * a_c;
    if (of_c <= 0.0 && a_b >= 0.0 && b_b <= 0.0) return of_line(a, b);
    const double of_b = c_b * a_c - a_b * c_c;
    if (of_b <= 0.0 && a_c >= 0.0 && c_c <= 0.0) return of_line(a, c);
    const double of_a = b_b * c_c - c_b * b_c;
    if (of_a <= 0.0 && b_c - b_b >= 0.0 && c_b - c_c >= 0.0) return of_line(b, c);
    const double whole = of_a + of_b + of_c;
    return {3, {a, b, c}, {of_a / whole, of_b / whole, of_c / whole}};
  }

  // Those of the face, among them that have the origin outside, whose point is closest.
  Weights of_tetrahedron() const {
    constexpr int faces[4][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}};
    Weights nearest;
    double least = BT_LARGE_FLOAT;
    for (const auto& [a, b, c, opposite] : faces) {
      const btVector3 normal = (at(b) - at(a)).cross(at(c) - at(a));
      const btVector3 edge = at(opposite) - at(a);
      const double inside = normal.dot(edge);
      const bool is_flat = inside * inside <= flat * normal.length2() * edge.length2();
      if (!is_flat && -normal.dot(at(a)) * inside > 0.0) continue;
      const Weights face = of_triangle(a, b, c);
      const double squared = closest(face).length2();
      if (squared >= least) continue;
      least = squared;
      nearest = face;
    }
    return nearest;
  }

  Vertex vertices_[4];
  int count_ = 0;
};

// An inner shape as EPA asks for it.
class InnerOfBullet : public btConvexInternalShape {
 public:
  explicit InnerOfBullet(const InnerShape& shape) : shape_(shape) { m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE; }

  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override {
    return shape_.support(direction);
  }
  void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions, btVector3* points,
                                                         int count) const override {
    for (int i = 0; i < count; ++i) points[i] = shape_.support(directions[i]);
  }
  void calculateLocalInertia(btScalar, btVector3&) const override {}
  const char* getName() const override { return "InnerOfBullet"; }

 private:
  const InnerShape& shape_;
};

}  // namespace

std::optional<ClosestPoints> distance_side_by_side(const InnerShape& a, const btTransform& pose_a, const InnerShape& b,
                                                   const btTransform& pose_b) {
  if (a.is_cylinder() && (b.is_cylinder() || b.is_box())) return beside(a, pose_a, b, pose_b);
  if (!a.is_box() || !b.is_cylinder()) return std::nullopt;
  std::optional<ClosestPoints> swapped = beside(b, pose_b, a, pose_a);
  if (swapped) {
    swapped->normal = -swapped->normal;
    swapped->on_b -= swapped->normal * swapped->distance;
  }
  return swapped;
}

// GJK (Gilbert, Johnson and Keerthi 1988): the point of their difference that is closest to the origin, in b's frame.
Separation SolidPair::inner_distance(const btTransform& pose_a, const btTransform& pose_b, double reach,
                                     ClosestPoints& result) {
  const bool approximates = margins() > 0.0;
  if (const auto found = approximates ? distance_side_by_side(a_, pose_a, b_, pose_b) : std::nullopt) {
    result = *found;
    return result.distance > reach ? Separation::too_far : Separation::apart;
  }
  const btMatrix3x3 turn = pose_b.getBasis().transposeTimes(pose_a.getBasis());
  const btVector3 offset = (pose_a.getOrigin() - pose_b.getOrigin()) * pose_b.getBasis();
  const auto vertex = [&](const btVector3& on_a, const btVector3& on_b) {
    return Vertex{turn * on_a + offset - on_b, on_a, on_b};
  };
  Simplex simplex;
  for (int i = 0; i < count_; ++i) simplex.add(vertex(on_a_[i], on_b_[i]));
  btVector3 closest(0.0, 1.0, 0.0);
  double squared = BT_LARGE_FLOAT;
  if (count_ > 0 && simplex.reduce()) {
    closest = simplex.closest();
    squared = closest.length2();
  }
  const auto keep = [&] {
    count_ = simplex.count();
    for (int i = 0; i < count_; ++i) {
      on_a_[i] = simplex[i].on_a;
      on_b_[i] = simplex[i].on_b;
    }
  };
  const auto known = [&] {
    keep();
    result.distance = btSqrt(squared);
    result.normal = pose_b.getBasis() * closest / result.distance;
    result.on_b = pose_b(simplex.on_b());
    return Separation::apart;
  };
  result = {btVector3(0.0, 0.0, 1.0), pose_b.getOrigin(), 0.0};
  const double least = clearly_apart(a_, b_);
  for (int i = 0; squared > least * least; ++i) {
    if (i == most_iterations) break;
    const Vertex next = vertex(a_.support(-closest * turn), b_.support(closest));
    const double bound = closest.dot(next.difference);
    if (bound > 0.0 && bound * bound > closest.length2() * reach * reach) {
      keep();
      return Separation::too_far;
    }
    if (squared - bound <= squared * (i < most_fine_iterations ? no_closer : hardly_closer)) return known();
    Simplex larger = simplex;
    if (!larger.extend(next, squared, bound > 0.0)) break;
    const btVector3 point = larger.closest();
    const double after = point.length2();
    if (after >= squared) return known();  // but for rounding
    simplex = larger;
    closest = point;
    squared = after;
  }
  count_ = 0;
  return Separation::too_near;
}

std::optional<ClosestPoints> SolidPair::closest(const btTransform& pose_a, const btTransform& pose_b, double reach,
                                                Penetration penetration) {
  ClosestPoints inner;
  const Separation separation = inner_distance(pose_a, pose_b, margins() + reach, inner);
  if (separation == Separation::too_far) return std::nullopt;
  if (separation == Separation::apart) return with_margins(inner);
  return penetration == Penetration::measured ? deepest(pose_a, pose_b) : std::nullopt;
}

// EPA ends early, or at a face that is not the nearest, where its points are flat. Its depth is no more than the right
// one, and the overlap along its normal no less: where they agree it is proven. Else they are parted along its normals
// and the axes, and what is least counts.
std::optional<ClosestPoints> SolidPair::deepest(const btTransform& pose_a, const btTransform& pose_b) const {
  const InnerOfBullet a(a_), b(b_);
  const double same = proven_depth * (a_.size() + b_.size());
  const btVector3 between = pose_b.getOrigin() - pose_a.getOrigin();
  std::optional<ClosestPoints> best;
  const auto part = [&](const btVector3& normal) {
    const ClosestPoints found = parted(pose_a, pose_b, normal);
    if (!best || found.distance > best->distance) best = found;
  };
  for (const btVector3& guess : {between, btVector3(1, 0, 0), btVector3(0, 1, 0), btVector3(0, 0, 1),
                                 btVector3(-1, 0, 0), btVector3(0, -1, 0), btVector3(0, 0, -1)}) {
    btGjkEpaSolver2::sResults found;
    constexpr bool with_margins = false;
    if (btGjkEpaSolver2::Penetration(&a, pose_a, &b, pose_b, guess, found, with_margins)) {
      const btVector3 along = pose_a.getBasis() * found.normal;  // Bullet's is in the frame of a
      const double forward = gap(pose_a, pose_b, along), backward = gap(pose_a, pose_b, -along);
      const btVector3 normal = forward < backward ? -along : along;
      const double distance = std::max(forward, backward);
      if (found.distance - margins() - distance <= same)
        return ClosestPoints{normal, found.witnesses[1] + normal * b_.margin(), distance};
      part(normal);
    }
    if (!guess.fuzzyZero()) part(-guess.normalized());
  }
  return best;
}

// Apart by a little more than they overlap along a normal, their closest points have one along which they overlap less.
ClosestPoints SolidPair::parted(const btTransform& pose_a, const btTransform& pose_b, const btVector3& normal) const {
  const double apart = least_apart * (a_.size() + b_.size());
  ClosestPoints best{normal, pose_b.getOrigin(), gap(pose_a, pose_b, normal)};
  for (int i = 0; i < most_iterations; ++i) {
    btTransform moved = pose_a;
    const btVector3 way = best.normal * (apart - best.distance);
    moved.getOrigin() += way;
    ClosestPoints inner;
    if (SolidPair(a_, b_).inner_distance(moved, pose_b, BT_LARGE_FLOAT, inner) != Separation::apart) break;
    const ClosestPoints found = with_margins(inner);
    const double distance = found.distance - found.normal.dot(way);
    const double nearer = distance - best.distance;
    if (nearer > 0.0 || i == 0) best = {found.normal, found.on_b, distance};
    if (nearer <= same_distance * apart) break;
  }
  return best;
}

ClosestPoints SolidPair::sharp_side(const btTransform& pose_a, const btTransform& pose_b,
                                    const ClosestPoints& rounded) const {
  if (!have_edges() || !(a_.is_cylinder() || b_.is_cylinder())) return rounded;
  const auto lies = [](const InnerShape& solid, const btTransform& pose, const btVector3& normal) {
    return solid.is_cylinder() && std::abs(pose.getBasis().getColumn(2).dot(normal)) < along_tilt;
  };
  const bool a_lies = lies(a_, pose_a, rounded.normal), b_lies = lies(b_, pose_b, rounded.normal);
  if (a_lies == b_lies || rounded.distance - gap(pose_a, pose_b, rounded.normal) <= same_distance * margins())
    return rounded;
  SolidPair side(a_lies ? a_.side() : a_.sharp(), b_lies ? b_.side() : b_.sharp());
  const auto found = side.closest(pose_a, pose_b, BT_LARGE_FLOAT, Penetration::ignored);
  return found && lies(a_lies ? a_ : b_, a_lies ? pose_a : pose_b, found->normal) ? *found : rounded;
}

// Rounded solids tell it where the sharp ones are as far apart along their normal: at faces and round sides.
std::optional<ClosestPoints> sharp_closest(const btConvexShape& a, const btTransform& pose_a, const btConvexShape& b,
                                           const btTransform& pose_b, double reach) {
  SolidPair rounded(a, b), solids(a, b, Edges::sharp);
  const bool has_hull = rounded.a().is_hull() || rounded.b().is_hull();  // whose corners may be needles
  const double nearer = has_hull ? rounded.a().size() + rounded.b().size() : most_rounded * rounded.margins();
  ClosestPoints inner;
  Separation separation = rounded.inner_distance(pose_a, pose_b, rounded.margins() + nearer + reach, inner);
  if (separation == Separation::too_far) return std::nullopt;
  if (separation == Separation::apart) {
    const ClosestPoints found = rounded.with_margins(inner);
    if (found.distance - rounded.gap(pose_a, pose_b, found.normal) <= same_distance * rounded.margins()) return found;
  }
  separation = solids.inner_distance(pose_a, pose_b, solids.margins() + reach, inner);
  if (separation == Separation::too_far) return std::nullopt;
  if (separation == Separation::too_near) {
    if (const auto deepest = solids.deepest(pose_a, pose_b)) return deepest;
  }
  return solids.with_margins(inner);  // EPA has nothing to say of what just touches
}

}  // namespace energymargin
