#pragma once
// Nodes by cell, of which those in thinly settled regions are drawn first.

#include <ompl/util/RandomNumbers.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "energymargin/random.hpp"

namespace energymargin::search {

//! The weights of cells in a Fenwick tree: one number a weight, and each operation takes the logarithm of their count.
class CellWeights {
 public:
  //! Appends one.
  void add(double weight) {
    const std::size_t i = sums_.size() + 1;
    for (std::size_t part = 1; part < width(i); part *= 2) weight += sums_[i - part - 1];
    sums_.push_back(weight);
  }

  //! Adds to one.
  void change(std::size_t index, double difference) {
    for (std::size_t i = index + 1; i <= sums_.size(); i += width(i)) sums_[i - 1] += difference;
  }

  //! The index at which the sum of the weights, from the first on, reaches `share` (0..1) of the sum of all. There is
  //! at least one weight.
  std::size_t at(double share) const {
    double sum = 0.0;
    for (std::size_t i = sums_.size(); i > 0; i -= width(i)) sum += sums_[i - 1];
    double left = share * sum;
    std::size_t step = 1;
    while (2 * step <= sums_.size()) step *= 2;
    std::size_t before = 0;
    // The last one takes what rounding leaves.
    for (; step > 0; step /= 2) {
      const std::size_t i = before + step;
      if (i >= sums_.size() || left <= sums_[i - 1]) continue;
      left -= sums_[i - 1];
      before = i;
    }
    return before;
  }

 private:
  // How many weights are in the i-th sum.
  static std::size_t width(std::size_t i) { return i & (~i + 1); }

  std::vector<double> sums_;  // sums_[i - 1] is that of the weights (i - (i & -i), i], counted from 1
};

//! Nodes by cell (Hsu, Latombe and Motwani 1999). Each cell is drawn with a weight of 1 / its nodes, and of these any.
//! The time of a draw does not depend on how many nodes are in a cell.
class DensityGrid {
 public:
  void add(int node, const Eigen::VectorXi& coordinates) {
    const auto [found, is_new] = index_.try_emplace(key_of(coordinates), static_cast<std::uint32_t>(cells_.size()));
    if (is_new) {
      cells_.emplace_back();
      weights_.add(1.0);
    }
    Cell& cell = cells_[found->second];
    const std::uint32_t size = cell.size;
    if ((size & (size - 1)) == 0) {
      const auto block = static_cast<std::uint32_t>(pool_.size());
      pool_.resize(block + std::max(2 * size, 1u));
      std::copy_n(pool_.begin() + cell.block, size, pool_.begin() + block);
      cell.block = block;
    }
    pool_[cell.block + cell.size++] = node;
    if (size > 0) weights_.change(found->second, 1.0 / cell.size - 1.0 / size);
  }

  //! A node; there is one.
  int draw(ompl::RNG& rng) const {
    const Cell& cell = cells_[weights_.at(rng.uniform01())];
    return pool_[cell.block + static_cast<std::uint32_t>(rng.uniformInt(0, static_cast<int>(cell.size) - 1))];
  }

  bool empty() const { return cells_.empty(); }

  //! Ascending.
  std::vector<int> nodes() const {
    std::vector<int> nodes;
    for (const Cell& cell : cells_) {
      const auto first = pool_.begin() + cell.block;
      nodes.insert(nodes.end(), first, first + cell.size);
    }
    std::sort(nodes.begin(), nodes.end());
    return nodes;
  }

 private:
  // Its nodes are a block of the pool. A cell whose size is a power of two is full: then it moves into a new block of
  // twice the size. The old block stays unused, so the pool has at most four numbers a node.
  struct Cell {
    std::uint32_t block = 0;
    std::uint32_t size = 0;
  };

  // A hash. Of a million cells two have the same with a chance of 3e-8, and then count as one.
  static std::uint64_t key_of(const Eigen::VectorXi& coordinates) {
    std::uint64_t key = 0;
    for (const int coordinate : coordinates) key = stream(key, static_cast<std::uint32_t>(coordinate));
    return key;
  }

  std::unordered_map<std::uint64_t, std::uint32_t> index_;  // of cells by their key
  std::vector<Cell> cells_;
  CellWeights weights_;
  std::vector<int> pool_;
};

}  // namespace energymargin::search
