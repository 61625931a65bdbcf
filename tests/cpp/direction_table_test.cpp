#include "physics/direction_table.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "physics/contacts/solid_pair.hpp"
#include "physics/shapes.hpp"

namespace energymargin {
namespace {

using Points = std::vector<btVector3>;

struct Cloud {
  std::string name;
  Points points;
};

class Random {
 public:
  double within(double most) { return std::uniform_real_distribution<double>(-most, most)(generator_); }
  int whole(int most) { return std::uniform_int_distribution<int>(-most, most)(generator_); }
  btVector3 vector() { return {within(1.0), within(1.0), within(1.0)}; }
  btVector3 whole_vector(int most) {
    const double x = whole(most), y = whole(most), z = whole(most);
    return {x, y, z};
  }

 private:
  std::mt19937_64 generator_{7};
};

Points prism(int sides, double radius, double half_length) {
  Points points;
  for (int i = 0; i < sides; ++i) {
    const double angle = SIMD_2_PI * i / sides;
    for (const double z : {-half_length, half_length})
      points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
  return points;
}

// A box's surface with points on its faces and edges, some of them twice.
Points grid(int cells) {
  Points points;
  for (int x = 0; x <= cells; ++x) {
    for (int y = 0; y <= cells; ++y) {
      for (int z = 0; z <= cells; ++z) {
        if (std::min({x, y, z}) > 0 && std::max({x, y, z}) < cells) continue;
        for (int i = 0; i <= (x + y + z) % 2; ++i) points.emplace_back(x, y, z);
      }
    }
  }
  return points;
}

std::vector<Cloud> clouds(Random& random) {
  std::vector<Cloud> clouds;
  for (const std::size_t count : {1, 2, 7, 15, 16, 17, 24, 33, 64, 150, 700}) {
    Points inside, on_sphere, whole;
    for (std::size_t i = 0; i < count; ++i) {
      inside.push_back(random.vector());
      on_sphere.push_back(random.vector().normalized());
      whole.push_back(random.whole_vector(3));
    }
    const std::string of = " of " + std::to_string(count);
    clouds.push_back({"inside" + of, inside});
    clouds.push_back({"sphere" + of, on_sphere});
    clouds.push_back({"whole" + of, whole});
    clouds.push_back({"one point" + of, Points(count, btVector3(0.3, -0.1, 0.2))});
  }
  for (const int sides : {8, 24, 64, 200})
    clouds.push_back({"prism " + std::to_string(sides), prism(sides, 0.04, 0.1)});
  for (const int cells : {1, 3, 5}) clouds.push_back({"grid " + std::to_string(cells), grid(cells)});
  const std::size_t made = clouds.size();
  for (std::size_t i = 0; i < made; ++i) {
    for (const double scale : {1e-120, 1e-6, 1e4}) {
      Cloud scaled = clouds[i];
      scaled.name += " times " + std::to_string(scale);
      for (btVector3& point : scaled.points) point *= scale;
      clouds.push_back(scaled);
    }
    Cloud far = clouds[i];
    far.name += " far away";
    for (btVector3& point : far.points) point += btVector3(500.0, -200.0, 0.0);
    clouds.push_back(far);
    Cloud flat = clouds[i];
    flat.name += " flat";
    for (btVector3& point : flat.points) point.setZ(0.0);
    clouds.push_back(flat);
  }
  return clouds;
}

// Random ones, axes, borders of cells, whole ones, those across two points, along which both are equally far, and those
// near to such ones; and all that at other lengths.
std::vector<btVector3> directions(Random& random, const Points& points) {
  std::vector<btVector3> directions;
  const auto any = [&] {
    const double last = static_cast<double>(points.size() - 1);
    return points[static_cast<std::size_t>(std::lround(0.5 * last * (1.0 + random.within(1.0))))];
  };
  for (int i = 0; i < 30; ++i) {
    directions.push_back(random.vector());
    directions.push_back(random.vector().normalized());
    directions.push_back(random.whole_vector(1));
    directions.push_back(random.whole_vector(8) / 8.0);
    directions.push_back(random.whole_vector(3));
    const btVector3 across = (any() - any()).cross(any() - any());
    if (across.length2() > 1e-30) {
      directions.push_back(across.normalized());
      directions.push_back(across.normalized() + 1e-15 * random.vector());
    }
  }
  const std::size_t made = directions.size();
  for (std::size_t i = 0; i < made; i += 5) {
    for (const double length : {1e-200, 1e-90, 1e-3, 1e50, 1e120}) directions.push_back(directions[i] * length);
  }
  const double none = std::numeric_limits<double>::quiet_NaN();
  directions.emplace_back(none, none, none);
  return directions;
}

// One point after the other.
std::size_t first_of_farthest(const Points& points, const btVector3& direction) {
  const auto nearer = [&](const btVector3& a, const btVector3& b) { return direction.dot(a) < direction.dot(b); };
  return static_cast<std::size_t>(std::max_element(points.begin(), points.end(), nearer) - points.begin());
}

TEST(DirectionTable, HasThePointThatALookAtAllOfThemFinds) {
  Random random;
  int by_table = 0;
  for (const Cloud& cloud : clouds(random)) {
    const PointSet set(cloud.points);
    const DirectionTable table(cloud.points, 0.0);
    for (const btVector3& direction : directions(random, cloud.points)) {
      const std::size_t known = first_of_farthest(cloud.points, direction);
      ASSERT_EQ(set.farthest(direction), known) << cloud.name;
      const DirectionTable::Candidates candidates = table.at(direction);
      if (candidates.empty()) continue;
      ++by_table;
      ASSERT_TRUE(std::is_sorted(candidates.begin(), candidates.end())) << cloud.name;
      ASSERT_TRUE(std::binary_search(candidates.begin(), candidates.end(), known)) << cloud.name;
    }
  }
  EXPECT_GT(by_table, 10000);
}

TEST(DirectionTable, HasAllPointsWithinItsDepth) {
  Random random;
  for (const Cloud& cloud : clouds(random)) {
    double size = 0.0;
    for (const btVector3& point : cloud.points) size = std::max(size, point.length());
    const double depth = 0.05 * size;
    const PointSet set(cloud.points, depth);
    for (const btVector3& any : directions(random, cloud.points)) {
      if (!(any.length() > 1e-80 && any.length() < 1e80)) continue;
      const btVector3 direction = any.normalized();
      const double most = direction.dot(cloud.points[first_of_farthest(cloud.points, direction)]);
      for (const double asked : {0.0, 0.5 * depth, depth, 2.0 * depth}) {
        std::vector<std::size_t> near, known;
        const auto is_near = [&](std::size_t i) { return direction.dot(cloud.points[i]) >= most - asked; };
        set.for_each_near(direction, asked, [&](std::size_t i) {
          if (is_near(i)) near.push_back(i);
        });
        for (std::size_t i = 0; i < cloud.points.size(); ++i) {
          if (is_near(i)) known.push_back(i);
        }
        ASSERT_EQ(near, known) << cloud.name;
      }
    }
  }
}

TEST(DirectionTable, LeavesFewOfManyPointsOrAsksForAllOfThem) {
  Random random;
  Points points;
  for (int i = 0; i < 400; ++i) points.push_back(random.vector().normalized());
  const DirectionTable table(points, 0.0);
  std::ptrdiff_t most = 0;
  for (int i = 0; i < 1000; ++i) {
    const DirectionTable::Candidates candidates = table.at(random.vector());
    ASSERT_FALSE(candidates.empty());
    most = std::max(most, candidates.last - candidates.first);
  }
  EXPECT_LT(most, 30);
  const DirectionTable of_prism(prism(200, 0.04, 0.1), 0.0);
  EXPECT_TRUE(of_prism.at(btVector3(0.01, 0.0, 1.0)).empty());  // along which half of its points are as far
  EXPECT_FALSE(of_prism.at(btVector3(1.0, 0.2, 0.01)).empty());
}

TEST(HullShape, HasTheSameFarthestPointsAndFacesAsALookAtAllOfThem) {
  Random random;
  for (const Cloud& cloud : clouds(random)) {
    std::vector<Vector3> points;
    btVector3 low = cloud.points.front(), high = low;
    for (const btVector3& point : cloud.points) {
      points.push_back(from_bullet(point));
      low.setMin(point);
      high.setMax(point);
    }
    const double least = std::min({high.x() - low.x(), high.y() - low.y(), high.z() - low.z()});
    if (!(least > 1e-9) || points.size() < 4) continue;
    const HullShape hull(points, 0.05 * least);
    Points inner, normals;
    for (int i = 0; i < hull.getNumPoints(); ++i) inner.push_back(hull.getUnscaledPoints()[i]);
    std::vector<btVector3> asked = directions(random, cloud.points);
    hull.for_each_face_near(btVector3(1, 0, 0), -2.0, [&](const btVector3& normal, double) {
      normals.push_back(normal);
      asked.push_back(normal);
      asked.push_back(-normal);
    });
    for (const btVector3& direction : asked) {
      ASSERT_EQ(&hull.farthest_point(direction), hull.getUnscaledPoints() + first_of_farthest(inner, direction));
      const btVector3& corner = hull.corners()[first_of_farthest(hull.corners(), direction)];
      ASSERT_EQ(&hull.farthest_corner(direction), &corner) << cloud.name;
      const std::pair<double, double> extent = hull.extent(direction);
      if (std::isfinite(direction.length())) {
        EXPECT_EQ(extent.second, direction.dot(corner)) << cloud.name;
        EXPECT_EQ(extent.first, direction.dot(hull.corners()[first_of_farthest(hull.corners(), -direction)]))
            << cloud.name;
      }
      if (!normals.empty()) {
        ASSERT_EQ(hull.face_along(direction).normal, normals[first_of_farthest(normals, direction)]) << cloud.name;
      }
    }
  }
}

}  // namespace
}  // namespace energymargin
