#include "physics/native/velocity_system.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "physics/native/kernels.hpp"

namespace energymargin {
namespace {

constexpr std::size_t few = 4;  // movers, whose order hardly matters

std::size_t index(int i) { return static_cast<std::size_t>(i); }

// Calls `visit` with the rows of an island, and with its open contacts, which would have some: the order of movers, and
// so the bits, are those with them.
template <typename Visit>
void for_each_row(const VelocitySystem& system, const Island& island, const Visit& visit) {
  for (const std::size_t i : island.contacts) visit(system.contacts()[i]);
  for (const std::size_t i : island.limited) visit(system.limited()[i]);
  for (const std::size_t i : island.open) visit(system.open()[i]);
}

}  // namespace

void VelocitySystem::clear() {
  movers_.clear();
  inertias_.clear();
  inverse_diagonal_.clear();
  kept_ = 0;
  free_.clear();
  velocities_.clear();
  recovery_.clear();
  numbers_.clear();
  contacts_.clear();
  limited_.clear();
  open_.clear();
}

int VelocitySystem::add_mover(int count) {
  const int begin = static_cast<int>(velocities_.size());
  movers_.push_back({begin, count, inertias_.size()});
  const auto size = static_cast<std::size_t>(begin + count);
  inertias_.resize(inertias_.size() + static_cast<std::size_t>(count * count));
  free_.resize(size);
  velocities_.resize(size);
  recovery_.resize(size);
  return static_cast<int>(movers_.size()) - 1;
}

// Keeps the inverse diagonals of movers that are new.
void VelocitySystem::keep_diagonals() {
  for (; kept_ < movers_.size(); ++kept_) {
    const Mover& mover = movers_[kept_];
    for (int i = 0; i < mover.count; ++i) {
      inverse_diagonal_.push_back(1.0 / inertias_[mover.inertia + static_cast<std::size_t>(i * mover.count + i)]);
    }
  }
}

void VelocitySystem::add_sides(RowSides& sides, int a, int b, int rows) {
  keep_diagonals();
  sides.a = a;
  sides.b = b == a ? -1 : b;
  const auto add = [&](int mover, std::size_t& begin) {
    begin = numbers_.size();
    if (mover >= 0) numbers_.resize(begin + static_cast<std::size_t>(rows * count(mover)));
  };
  add(sides.a, sides.of_a);
  add(sides.b, sides.of_b);
}

ContactRows& VelocitySystem::add_contact(int a, int b, int rows) {
  contacts_.emplace_back();
  contacts_.back().law.rows = rows;
  add_sides(contacts_.back(), a, b, rows);
  return contacts_.back();
}

LimitedRow& VelocitySystem::add_limited(int a, int b) {
  limited_.emplace_back();
  add_sides(limited_.back(), a, b, 1);
  return limited_.back();
}

// Those of two movers, in this order, with numbers of zero at first.
OpenContacts& VelocitySystem::open_contacts(int a, int b) {
  const auto known = std::find_if(open_.rbegin(), open_.rend(), [=](const auto& of) { return of.a == a && of.b == b; });
  if (known != open_.rend()) return *known;
  open_.emplace_back();
  add_sides(open_.back(), a, b, 1);
  return open_.back();
}

double VelocitySystem::inverse_mass(const RowSides& sides, int row) const {
  double sum = 0.0;
  for_each_side(sides, [&](const Mover& mover, const double* jacobian) {
    jacobian += row * mover.count;
    const double* inverses = inverse_diagonal_.data() + mover.begin;
    for (int i = 0; i < mover.count; ++i) sum += jacobian[i] * jacobian[i] * inverses[i];
  });
  return sum;
}

double VelocitySystem::delassus(const LimitedRow& a, const LimitedRow& b) const {
  double sum = 0.0;
  for (const auto& [mover, of_a, of_b] : {std::tuple{a.a, a.of_a, b.of_a}, {a.b, a.of_b, b.of_b}}) {
    if (mover < 0) continue;
    const double* const inverses = inverse_diagonal_.data() + begin(mover);
    for (int i = 0; i < count(mover); ++i) sum += numbers(of_a)[i] * numbers(of_b)[i] * inverses[i];
  }
  return sum;
}

double VelocitySystem::speed(const RowSides& sides, int row, const std::vector<double>& velocities) const {
  double sum = 0.0;
  for_each_side(sides, [&](const Mover& mover, const double* jacobian) {
    sum += dot(jacobian + row * mover.count, velocities.data() + mover.begin, mover.count);
  });
  return sum;
}

ContactVector VelocitySystem::speeds(const ContactRows& rows, const std::vector<double>& velocities) const {
  ContactVector sums{};
  for_each_side(rows, [&](const Mover& mover, const double* jacobian) {
    const double* const of_mover = velocities.data() + mover.begin;
    if (mover.count == usual_count && rows.law.rows == usual_rows) return add_speeds(jacobian, of_mover, sums);
    for (std::size_t row = 0; row < static_cast<std::size_t>(rows.law.rows); ++row) {
      sums[row] += dot(jacobian + row * static_cast<std::size_t>(mover.count), of_mover, mover.count);
    }
  });
  return sums;
}

int Islands::root(int mover) {
  while (parents_[index(mover)] != mover) {
    int& parent = parents_[index(mover)];
    parent = parents_[index(parent)];
    mover = parent;
  }
  return mover;
}

// The root is the first mover of an island.
void Islands::join(const RowSides& sides) {
  if (sides.a < 0 || sides.b < 0) return;
  const int a = root(sides.a);
  const int b = root(sides.b);
  parents_[index(std::max(a, b))] = std::min(a, b);
}

void Islands::find(const VelocitySystem& system) {
  const std::size_t movers = system.movers().size();
  parents_.resize(movers);
  places_.resize(movers);
  rows_.resize(movers);
  std::iota(parents_.begin(), parents_.end(), 0);
  for (const ContactRows& rows : system.contacts()) join(rows);
  for (const LimitedRow& row : system.limited()) join(row);
  for (const OpenContacts& open : system.open()) join(open);
  count_ = 0;
  for (std::size_t i = 0; i < movers; ++i) {
    const int first = root(static_cast<int>(i));
    if (first == static_cast<int>(i)) {
      places_[i] = static_cast<int>(count_++);
      if (islands_.size() < count_) islands_.emplace_back();
      Island& island = islands_[count_ - 1];
      island.movers.clear();
      island.contacts.clear();
      island.limited.clear();
      island.open.clear();
    }
    places_[i] = places_[index(first)];
    islands_[index(places_[i])].movers.push_back(static_cast<int>(i));
  }
  const auto add = [&](const RowSides& sides, std::vector<std::size_t> Island::* rows, std::size_t i) {
    if (sides.a < 0 && sides.b < 0) return;
    const int mover = sides.a >= 0 ? sides.a : sides.b;
    (islands_[index(places_[index(mover)])].*rows).push_back(i);
  };
  for (std::size_t i = 0; i < system.contacts().size(); ++i) add(system.contacts()[i], &Island::contacts, i);
  for (std::size_t i = 0; i < system.limited().size(); ++i) add(system.limited()[i], &Island::limited, i);
  for (std::size_t i = 0; i < system.open().size(); ++i) add(system.open()[i], &Island::open, i);
  for (std::size_t i = 0; i < count_; ++i) {
    if (!islands_[i].free()) order(system, islands_[i]);
  }
}

// Numbers the rows of an island's matrix.
void Islands::order(const VelocitySystem& system, Island& island) {
  if (island.movers.size() > few) order_by_neighbours(system, island);
  int size = 0;
  for (const int i : island.movers) {
    rows_[index(i)] = size;
    size += system.count(i);
  }
  island.first.resize(index(size));
  for (const int i : island.movers) std::fill_n(island.first.begin() + row(i), system.count(i), row(i));
  for_each_row(system, island, [&](const RowSides& sides) {
    if (sides.a < 0 || sides.b < 0) return;
    const auto [low, high] = std::minmax({row(sides.a), row(sides.b)});
    const int count = system.count(high == row(sides.a) ? sides.a : sides.b);
    for (int i = high; i < high + count; ++i) island.first[index(i)] = std::min(island.first[index(i)], low);
  });
}

// The order of Cuthill and McKee (1969), for a narrow envelope.
void Islands::order_by_neighbours(const VelocitySystem& system, Island& island) const {
  std::vector<std::vector<int>> neighbours(system.movers().size());
  for_each_row(system, island, [&](const RowSides& sides) {
    if (sides.a < 0 || sides.b < 0) return;
    neighbours[index(sides.a)].push_back(sides.b);
    neighbours[index(sides.b)].push_back(sides.a);
  });
  for (const int i : island.movers) {
    std::vector<int>& of = neighbours[index(i)];
    std::sort(of.begin(), of.end());
    of.erase(std::unique(of.begin(), of.end()), of.end());
  }
  const auto fewer = [&](int a, int b) { return neighbours[index(a)].size() < neighbours[index(b)].size(); };
  std::vector<bool> seen(system.movers().size(), false);
  std::vector<int> ordered{*std::min_element(island.movers.begin(), island.movers.end(), fewer)};
  seen[index(ordered.front())] = true;
  for (std::size_t next = 0; next < ordered.size(); ++next) {
    std::vector<int>& of = neighbours[index(ordered[next])];
    std::stable_sort(of.begin(), of.end(), fewer);
    for (const int other : of) {
      if (seen[index(other)]) continue;
      seen[index(other)] = true;
      ordered.push_back(other);
    }
  }
  island.movers = ordered;
}

}  // namespace energymargin
