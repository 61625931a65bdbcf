#pragma once
// Poses of the object, divided into cells that are halved where it matters.

#include <vector>

#include "bounds/obstacles.hpp"

namespace energymargin::bounds {

//! A cell with what is certain about it.
struct Cell {
  PoseCell poses{};
  int children = -1;  //!< the first of two, which follow each other; -1: it is a leaf
  Occupancy occupancy{};
  EnergyRange potential{};
  double exit = 0.0;  //!< the least kinetic energy with which it may be outside in it [J]; inf: it is not
};

//! What a cell is held against; it outlives the tree.
struct Landscape {
  const ObjectSpace& space;
  Obstacles obstacles;
  PotentialBounds potential;
  ExitEnergy exit;
};

class CellTree {
 public:
  //! `domain` has no width along axes that do not matter.
  CellTree(const Landscape& landscape, const PoseCell& domain)
      : landscape_(landscape), full_turn_(domain.high[turn_axis] > domain.low[turn_axis]) {
    cells_.push_back(cell(domain));
  }

  const Cell& operator[](int cell) const { return cells_[static_cast<std::size_t>(cell)]; }
  int size() const { return static_cast<int>(cells_.size()); }
  bool leaf(int cell) const { return (*this)[cell].children < 0; }

  //! How far the object moves within a cell along the axis on which it moves the farthest, from the middle [m].
  double width(int cell) const {
    const PoseCell& poses = (*this)[cell].poses;
    return width_along(poses, widest_axis(poses));
  }

  //! Halves a leaf across that axis.
  void split(int cell) {
    const PoseCell whole = (*this)[cell].poses;
    const int axis = widest_axis(whole);
    PoseCell lower = whole, upper = whole;
    lower.high[axis] = upper.low[axis] = 0.5 * (whole.low[axis] + whole.high[axis]);
    cells_[static_cast<std::size_t>(cell)].children = size();
    cells_.push_back(this->cell(lower));
    cells_.push_back(this->cell(upper));
  }

  //! The leaf of a pose of the domain.
  int leaf_at(const Coordinates& at) const {
    int cell = 0;
    while (!leaf(cell)) {
      const PoseCell& lower = (*this)[(*this)[cell].children].poses;
      cell = (*this)[cell].children + ((at.array() <= lower.high.array()).all() ? 0 : 1);
    }
    return cell;
  }

  //! The leaves that share a face with a leaf; turns meet at half a turn.
  void neighbours(int cell, std::vector<int>& found) const {
    found.clear();
    const PoseCell& poses = (*this)[cell].poses;
    touching(0, poses, cell, found);
    if (!full_turn_) return;
    const PoseCell& all = (*this)[0].poses;
    for (const bool upper : {true, false}) {
      const bool at_end =
          upper ? poses.high[turn_axis] == all.high[turn_axis] : poses.low[turn_axis] == all.low[turn_axis];
      if (!at_end) continue;
      PoseCell around = poses;
      around.low[turn_axis] = around.high[turn_axis] = upper ? all.low[turn_axis] : all.high[turn_axis];
      touching(0, around, cell, found);
    }
  }

 private:
  double width_along(const PoseCell& poses, int axis) const {
    const double half = 0.5 * (poses.high[axis] - poses.low[axis]);
    return axis == turn_axis ? half * landscape_.space.radius() : half;
  }

  int widest_axis(const PoseCell& poses) const {
    int widest = 0;
    for (int axis = 1; axis <= turn_axis; ++axis) {
      if (width_along(poses, axis) > width_along(poses, widest)) widest = axis;
    }
    return widest;
  }

  Cell cell(const PoseCell& poses) const {
    Cell made;
    made.poses = poses;
    made.occupancy = landscape_.obstacles.occupancy(poses);
    if (made.occupancy.blocked) return made;
    made.potential = landscape_.potential(poses);
    made.exit = landscape_.exit.crossing(poses).outside;
    return made;
  }

  // Cells that meet at an edge or a corner alone are left out: neighbours there share a face with both.
  void touching(int at, const PoseCell& poses, int except, std::vector<int>& found) const {
    const PoseCell& other = (*this)[at].poses;
    int faces = 0;
    for (int axis = 0; axis <= turn_axis; ++axis) {
      const double low = std::max(poses.low[axis], other.low[axis]);
      const double high = std::min(poses.high[axis], other.high[axis]);
      if (low > high) return;
      faces += low == high && other.low[axis] < other.high[axis];
    }
    if (faces > 1) return;
    if (!leaf(at)) {
      touching((*this)[at].children, poses, except, found);
      touching((*this)[at].children + 1, poses, except, found);
    } else if (at != except && !(*this)[at].occupancy.blocked) {
      found.push_back(at);
    }
  }

  const Landscape& landscape_;
  bool full_turn_;
  std::vector<Cell> cells_;
};

}  // namespace energymargin::bounds
