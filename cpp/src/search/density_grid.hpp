#pragma once
// The grid in which EST counts its nodes, and the draw of the node that it extends.

#include <ompl/util/RandomNumbers.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "search/cell_weights.hpp"

namespace energymargin::search {

//! Nodes by cell (Hsu, Latombe and Motwani 1999), in flat rows. Each cell is drawn with a weight of 1 / its nodes, and
//! of these any: so nodes in thinly settled regions come first. The time of a draw does not depend on how many nodes
//! are in a cell.
class DensityGrid {
 public:
  void add(int node, const Eigen::VectorXi& coordinates);

  //! A node; there is one.
  int draw(ompl::RNG& rng) const;

  bool empty() const { return cells_.empty(); }

  //! Ascending.
  std::vector<int> nodes() const;

 private:
  // Its nodes are a block of the pool. A cell whose size is a power of two is full: then it moves into a new block of
  // twice the size. The old block stays unused, so the pool has at most four numbers a node.
  struct Cell {
    std::uint64_t key;
    std::uint32_t block;
    std::uint32_t size;
  };

  Cell& cell_of(std::uint64_t key);
  std::size_t slot_of(std::uint64_t key) const;
  void make_index(std::size_t slots);

  std::vector<Cell> cells_;
  CellWeights weights_;
  std::vector<int> pool_;
  std::vector<int> index_;  // cells by their key, open addressing; -1: free
};

}  // namespace energymargin::search
