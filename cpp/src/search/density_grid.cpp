#include "search/density_grid.hpp"

#include <algorithm>

namespace energymargin::search {
namespace {

constexpr std::size_t first_slots = 16;

std::size_t hash(const int* coordinates, unsigned int dimension) {
  std::uint64_t hash = 0;
  for (unsigned int i = 0; i < dimension; ++i) {
    hash = (hash ^ static_cast<std::uint32_t>(coordinates[i])) * 0x9e3779b97f4a7c15;
    hash ^= hash >> 32;
  }
  return hash;
}

}  // namespace

void DensityGrid::add(int node, const Eigen::VectorXi& coordinates) {
  Cell& cell = cell_at(coordinates);
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

void DensityGrid::clear() { *this = DensityGrid(dimension_); }

// A new one is empty.
DensityGrid::Cell& DensityGrid::cell_at(const Eigen::VectorXi& coordinates) {
  if (2 * cells_.size() >= index_.size()) make_index(std::max(2 * index_.size(), first_slots));
  int& cell = index_[slot_of(coordinates.data())];
  if (cell < 0) {
    cell = static_cast<int>(cells_.size());
    coordinates_.insert(coordinates_.end(), coordinates.begin(), coordinates.end());
    cells_.push_back({0, 0});
    weights_.add(1.0);
  }
  return cells_[static_cast<std::size_t>(cell)];
}

// Where these coordinates are in the index, or the free place for them.
std::size_t DensityGrid::slot_of(const int* coordinates) const {
  const std::size_t mask = index_.size() - 1;
  std::size_t slot = hash(coordinates, dimension_) & mask;
  const auto differs = [&](int cell) {
    return !std::equal(coordinates, coordinates + dimension_,
                       coordinates_.data() + static_cast<std::size_t>(cell) * dimension_);
  };
  while (index_[slot] >= 0 && differs(index_[slot])) slot = (slot + 1) & mask;
  return slot;
}

void DensityGrid::make_index(std::size_t slots) {
  index_.assign(slots, -1);
  for (std::size_t cell = 0; cell < cells_.size(); ++cell) {
    index_[slot_of(coordinates_.data() + cell * dimension_)] = static_cast<int>(cell);
  }
}

}  // namespace energymargin::search
