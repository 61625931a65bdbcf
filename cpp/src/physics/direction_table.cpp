#include "physics/direction_table.hpp"

#include <functional>
#include <limits>
#include <numeric>

namespace energymargin {
namespace {

constexpr double rounding_of_points = 1e-9;  // a share of their distance from the origin: more than that of any product

constexpr std::size_t most_left = 3;  // a look at all points, several at a time, is as fast as one at a third of them

// More points have smaller cells, so that few are left in each.
int cells_for(std::size_t points) {
  constexpr int most_cells = 16;
  int cells = 4;
  while (cells < most_cells && static_cast<std::size_t>(8 * cells * cells) < points) cells *= 2;
  return cells;
}

}  // namespace

DirectionTable::Directions DirectionTable::Square::directions() const {
  Directions directions;
  for (int i = 0; i < 5; ++i) {
    btVector3& at = directions[static_cast<std::size_t>(i)];
    at.setZero();
    at[axis] = sign;
    at[(axis + 1) % 3] = u + size * (i == 4 ? 0.5 : i & 1);
    at[(axis + 2) % 3] = v + size * (i == 4 ? 0.5 : i >> 1);
  }
  return directions;
}

// A point is out if another one is farther by more than the depth at all corners of the square. It is so between them,
// too: there directions are means of those, and how far one point is ahead of another is linear in the direction.
std::vector<DirectionTable::Index> DirectionTable::candidates(const std::vector<btVector3>& points,
                                                              const std::vector<Index>& among,
                                                              const Square& square) const {
  const Directions directions = square.directions();
  constexpr std::size_t middle = 4;
  std::vector<std::array<double, middle + 1>> along(among.size());
  std::array<std::size_t, middle + 1> farthest{};
  double longest = 0.0;
  for (std::size_t k = 0; k <= middle; ++k) {
    for (std::size_t i = 0; i < among.size(); ++i) {
      along[i][k] = directions[k].dot(points[among[i]]);
      if (along[i][k] > along[farthest[k]][k]) farthest[k] = i;
    }
    longest = std::max(longest, directions[k].length());
  }
  const double least = depth_ * longest + rounding_;
  const auto is_behind = [&](std::size_t i, std::size_t other) {
    for (std::size_t k = 0; k < middle; ++k) {
      if (!(along[other][k] - along[i][k] > least)) return false;
    }
    return true;
  };
  std::vector<Index> left;
  for (std::size_t i = 0; i < among.size(); ++i) {
    const auto beats = [&](std::size_t other) { return is_behind(i, other); };
    if (std::none_of(farthest.rbegin(), farthest.rend(), beats)) left.push_back(among[i]);
  }
  return left;
}

DirectionTable::DirectionTable(const std::vector<btVector3>& points, double depth) : depth_(depth) {
  double size = 0.0;
  for (const btVector3& point : points) size = std::max(size, point.length());
  if (points.size() > std::numeric_limits<Index>::max() || !(size >= least_length && size <= most_length)) return;
  rounding_ = rounding_of_points * size;
  cells_ = cells_for(points.size());
  std::vector<std::vector<Index>> cells(static_cast<std::size_t>(6 * cells_ * cells_));
  std::vector<Index> all(points.size());
  std::iota(all.begin(), all.end(), Index{0});
  // Candidates of a quarter are among those of its square.
  const std::function<void(const Square&, const std::vector<Index>&, int, int, int)> divide =
      [&](const Square& square, const std::vector<Index>& among, int count, int u, int v) {
        std::vector<Index> left = candidates(points, among, square);
        if (count == 1) {
          const int face = 2 * square.axis + (square.sign < 0.0);
          cells[static_cast<std::size_t>((face * cells_ + u) * cells_ + v)] = std::move(left);
          return;
        }
        for (int i = 0; i < 4; ++i) {
          const int half = count / 2;
          divide(square.quarter(i), left, half, u + (i & 1) * half, v + (i >> 1) * half);
        }
      };
  for (int face = 0; face < 6; ++face) divide({face / 2, face % 2 ? -1.0 : 1.0, -1.0, -1.0, 2.0}, all, cells_, 0, 0);
  for (const std::vector<Index>& cell : cells) {
    begins_.push_back(static_cast<std::uint32_t>(items_.size()));
    if (most_left * cell.size() <= points.size()) items_.insert(items_.end(), cell.begin(), cell.end());
  }
  begins_.push_back(static_cast<std::uint32_t>(items_.size()));
  items_.shrink_to_fit();
}

}  // namespace energymargin
