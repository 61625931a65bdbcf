#pragma once
// Outlines: polygons and lines in the plane of a contact, each corner with its height along the normal.

#include <LinearMath/btVector3.h>

#include <optional>
#include <vector>

namespace energymargin::outlines {

//! Corners of a face so near are the ends of an edge along the normal: a share of the depth in which they count.
inline constexpr double same_corner = 1e-2;

//! A corner, in the plane of contact and along its normal [m].
struct Corner {
  double x, y, height;
};

//! In counter-clockwise order: a face; two corners: a line; one: a point.
using Face = std::vector<Corner>;

//! The plane of contact.
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

//! How a face rises along the plane of contact.
struct Slope {
  double x = 0.0, y = 0.0;
};

//! Twice the area of a triangle, above 0 where it turns left.
inline double cross(const Corner& from, const Corner& to, const Corner& point) {
  return (to.x - from.x) * (point.y - from.y) - (to.y - from.y) * (point.x - from.x);
}

//! In the plane [m^2].
inline double squared_distance(const Corner& a, const Corner& b) {
  return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
}

//! The point at a share of the way.
inline Corner between(const Corner& a, const Corner& b, double share) {
  return {a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.height + share * (b.height - a.height)};
}

//! Leaves the corners of the convex hull, in counter-clockwise order (Andrew 1979).
void order(Face& face, Face& scratch, double outward, double depth);

//! Of a face [m^2].
double area(const Face& face);

//! Leaves what of a face or a line is on the left of the line from `from` to `to`.
void cut(Face& face, Face& scratch, const Corner& from, const Corner& to);

//! Leaves what of a line lies beside another one, unless they cross.
void cut_to_line(Face& line, Face& scratch, const Face& other);

//! Where two lines cross, if they do and are not parallel.
std::optional<Corner> crossing(const Face& line, const Face& other);

//! Leaves out corners that are nearer than `offset` to the line between their neighbours: edges that nearly lie on one
//! another cross anywhere.
void straighten(Face& face, Face& scratch, double offset);

//! Whether a point of the plane is in a face, its edges included.
bool is_inside(const Face& face, const Corner& point);

//! Height of a line or a face at a point of the plane.
double height_at(const Face& face, const Corner& point);

//! Of a line none.
Slope slope_of(const Face& face);

}  // namespace energymargin::outlines
