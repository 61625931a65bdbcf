#pragma once
// The circles of a cylinder's ends, as outlines.

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "base/portable.hpp"
#include "physics/contacts/outlines.hpp"
#include "physics/contacts/solid_pair.hpp"

namespace energymargin::outlines {

inline constexpr double lying = 0.7;         // sine of the angle between a round solid's axis and the normal
inline constexpr double least_tilt = 1e-10;  // sine, of which rounding leaves the direction

//! Calls `visit` with the corners of a cylinder's rim, of which one is the lowest along `down` in its frame, at a
//! height.
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

//! The circle around a cylinder's end: center + cos x + sin y.
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

//! That of the end that faces `outward` along the normal, unless the cylinder lies on its side.
std::optional<Rim> rim_of(const InnerShape& solid, const btTransform& pose, const ContactPlane& plane, double outward);

//! Where a circle crosses the edges of a face or a line.
void add_crossings(const Rim& rim, const Face& other, std::vector<double>& angles);

//! Where it crosses another circle.
void add_crossings(const Rim& rim, const Rim& other, std::vector<double>& angles);

//! The corners of a rim within `depth` of its outermost one: it bears where its circle does, so they are at eighths of
//! a turn from where it is nearest to a face of that slope, however little nearer, and at `angles`. Whether all are.
bool find_rim(const Rim& rim, double outward, double depth, const Slope& other, std::vector<double>& angles,
              Face& face);

}  // namespace energymargin::outlines
