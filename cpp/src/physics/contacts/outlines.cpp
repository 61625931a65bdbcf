#include "physics/contacts/outlines.hpp"

#include <algorithm>

namespace energymargin::outlines {
namespace {

constexpr double parallel = 0.02;  // sine of the angle between two lines that lie on one another
constexpr double straight_corner =
    1e-6;  // share of the depth: a corner so near the line between its neighbours is none

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

}  // namespace

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

}  // namespace energymargin::outlines
