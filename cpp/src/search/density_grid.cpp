#include "search/density_grid.hpp"

#include <algorithm>

#include "energymargin/random.hpp"

namespace energymargin::search {
namespace {

constexpr std::size_t first_slots = 16;

// A hash. Of a million cells two have the same with a chance of 3e-8, and then count as one.
std::uint64_t key_of(const Eigen::VectorXi& coordinates) {
  std::uint64_t key = 0;
  for (const int coordinate : coordinates) key = stream(key, static_cast<std::uint32_t>(coordinate));
  return key;
}

}  // namespace

void DensityGrid::add(int node, const Eigen::VectorXi& coordinates) {
  Cell& cell = cell_of(key_of(coordinates));
  const std::uint32_t size = cell.size;
  if ((size & (size - 1)) == 0) {
    const auto block = static_cast<std::uint32_t>(pool_.size());
    pool_.resize(block + std::max(2 * size, 1u));
    std::copy_n(pool_.begin() + cell.block, size, pool_.begin() + block);
    cell.block = block;
  }
  pool_[cell.block + cell.size++] = node;
  const auto index = static_cast<std::size_t>(&cell - cells_.data());
  if (size > 0) weights_.change(index, 1.0 / cell.size - 1.0 / size);
}

int DensityGrid::draw(ompl::RNG& rng) const {
  const Cell& cell = cells_[weights_.at(rng.uniform01())];
  return pool_[cell.block + static_cast<std::uint32_t>(rng.uniformInt(0, static_cast<int>(cell.size) - 1))];
}

std::vector<int> DensityGrid::nodes() const {
  std::vector<int> nodes;
  for (const Cell& cell : cells_) {
    const auto first = pool_.begin() + cell.block;
    nodes.insert(nodes.end(), first, first + cell.size);
  }
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

// A new one is empty.
DensityGrid::Cell& DensityGrid::cell_of(std::uint64_t key) {
  if (2 * cells_.size() >= index_.size()) make_index(std::max(2 * index_.size(), first_slots));
  int& cell = index_[slot_of(key)];
  if (cell < 0) {
    cell = static_cast<int>(cells_.size());
    cells_.push_back({key, 0, 0});
    weights_.add(1.0);
  }
  return cells_[static_cast<std::size_t>(cell)];
}

// Where a cell is in the index, or the free place for it.
std::size_t DensityGrid::slot_of(std::uint64_t key) const {
  const std::size_t mask = index_.size() - 1;
  std::size_t slot = key & mask;
  while (index_[slot] >= 0 && cells_[static_cast<std::size_t>(index_[slot])].key != key) slot = (slot + 1) & mask;
  return slot;
}

void DensityGrid::make_index(std::size_t slots) {
  index_.assign(slots, -1);
  for (std::size_t cell = 0; cell < cells_.size(); ++cell) index_[slot_of(cells_[cell].key)] = static_cast<int>(cell);
}

}  // namespace energymargin::search
