#pragma once
// Which of a solid's points can count in a direction.

#include <LinearMath/btVector3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace energymargin {

//! The points that can be within `depth` of the farthest one along a direction, by cells of a cube of directions. A
//! cell has all of them and few others, in ascending order: what is found among them is what is found among all, to the
//! bit.
class DirectionTable {
 public:
  using Index = std::uint16_t;

  //! An ascending list of points.
  struct Candidates {
    const Index *first, *last;

    bool empty() const { return first == last; }
    const Index* begin() const { return first; }
    const Index* end() const { return last; }
  };

  //! A table without cells, which has no candidates for any direction.
  DirectionTable() = default;

  //! `depth` in [m]. There are no cells if the points are too many, too small or too large for it.
  DirectionTable(const std::vector<btVector3>& points, double depth);

  double depth() const { return depth_; }

  //! None if there is no cell for a direction, or if more than a third of the points are in it: all of them count then.
  Candidates at(const btVector3& direction) const {
    const double along[5] = {direction.x(), direction.y(), direction.z(), direction.x(), direction.y()};
    const double x = std::abs(along[0]), y = std::abs(along[1]), z = std::abs(along[2]);
    double most = x;
    int axis = 0;
    if (y > most) most = y, axis = 1;
    if (z > most) most = z, axis = 2;
    if (!(most >= least_length && x + y + z <= most_length) || begins_.empty()) return {nullptr, nullptr};
    const double half = 0.5 * cells_, scale = half / most;
    const int u = std::min(static_cast<int>(along[axis + 1] * scale + half), cells_ - 1);
    const int v = std::min(static_cast<int>(along[axis + 2] * scale + half), cells_ - 1);
    const auto cell = static_cast<std::size_t>(((2 * axis + (along[axis] < 0.0)) * cells_ + u) * cells_ + v);
    return {items_.data() + begins_[cell], items_.data() + begins_[cell + 1]};
  }

 private:
  // Products of what is shorter or longer may be too small or too large for a number.
  static constexpr double least_length = 1e-100, most_length = 1e100;

  // A square of a face of the cube, with its corners and its middle.
  using Directions = std::array<btVector3, 5>;

  struct Square {
    int axis;
    double sign, u, v, size;

    Directions directions() const;
    Square quarter(int i) const {
      return {axis, sign, u + (i & 1) * 0.5 * size, v + (i >> 1) * 0.5 * size, 0.5 * size};
    }
  };

  std::vector<Index> candidates(const std::vector<btVector3>& points, const std::vector<Index>& among,
                                const Square& square) const;

  int cells_ = 0;  // along an edge of the cube
  double depth_ = 0.0, rounding_ = 0.0;
  std::vector<std::uint32_t> begins_;  // of each cell's items
  std::vector<Index> items_;
};

}  // namespace energymargin
