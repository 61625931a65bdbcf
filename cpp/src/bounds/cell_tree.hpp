#pragma once
// Poses of the object, divided into cells that are halved where it matters.

#include <vector>

#include "bounds/exit_energy.hpp"
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
  CellTree(const Landscape& landscape, const PoseCell& domain);

  const Cell& operator[](int cell) const { return cells_[static_cast<std::size_t>(cell)]; }
  int size() const { return static_cast<int>(cells_.size()); }
  bool leaf(int cell) const { return (*this)[cell].children < 0; }

  //! How far the object moves within a cell along the axis on which it moves the farthest, from the middle [m].
  double width(int cell) const;

  //! Halves a leaf across that axis.
  void split(int cell);

  //! The leaf of a pose of the domain.
  int leaf_at(const Coordinates& at) const;

  //! The leaves that share a face with a leaf; turns meet at half a turn.
  void neighbours(int cell, std::vector<int>& found) const;

 private:
  int widest_axis(const PoseCell& poses) const;
  double width_along(const PoseCell& poses, int axis) const;
  Cell cell(const PoseCell& poses) const;
  void touching(int at, const PoseCell& poses, int except, std::vector<int>& found) const;

  const Landscape& landscape_;
  bool full_turn_;
  std::vector<Cell> cells_;
};

}  // namespace energymargin::bounds
