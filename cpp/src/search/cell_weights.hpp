#pragma once
// The weights of EST's cells, and the draw of a cell.

#include <cstddef>
#include <vector>

namespace energymargin::search {

//! Weights in a Fenwick tree: one number a weight, and each operation takes the logarithm of their count.
class CellWeights {
 public:
  //! Appends one.
  void add(double weight);

  //! Adds to one.
  void change(std::size_t index, double difference);

  //! The index at which the sum of the weights, from the first on, reaches `share` (0..1) of the sum of all. There is
  //! at least one weight.
  std::size_t at(double share) const;

 private:
  double sum(std::size_t count) const;

  std::vector<double> sums_;  // sums_[i - 1] is that of the weights (i - (i & -i), i], counted from 1
};

}  // namespace energymargin::search
