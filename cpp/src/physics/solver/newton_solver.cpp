#include "physics/solver/newton_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#ifdef DEV_COUNT
long g_newton[4];
#define COUNT(i,n) g_newton[i]+=(n)
#include <cstdio>
bool g_trace=false;
#define TRACE(...) if(g_trace) std::printf(__VA_ARGS__)
#else
#define COUNT(i,n)
#define TRACE(...)
#endif
namespace energymargin {
namespace {

// So many iterations on Coulomb's law have to leave less than this share of the error.
constexpr double enough = 0.5;
constexpr int patience = 3;

// The convex law is solved to this error before Coulomb's is tried again.
constexpr double convex_tolerance = 1e-3;

// Contacts are softer by these factors, one after the other, while a start for Coulomb's law is looked for; and what is
// good enough on the way.
constexpr double softenings[] = {1.0};
constexpr double soft_tolerance = 0.1;

// A line search ends where this share of the slope is left.
constexpr double flat_share = 0.1;
constexpr int most_trials = 20;

// The error that rounding leaves in stiff rows, as a share of the momenta.
constexpr double rounding_share = 1e-10;

double dot(const double* a, const double* b, int count) {
  double sum = 0.0;
  for (int i = 0; i < count; ++i) sum += a[i] * b[i];
  return sum;
}

double limited_impulse(const LimitedRow& row, double miss) {
  return std::min(std::max(miss / row.softness, row.low), row.high);
}

double limited_slope(const LimitedRow& row, double miss) {
  const double impulse = miss / row.softness;
  return impulse > row.low && impulse < row.high ? 1.0 / row.softness : 0.0;
}

}  // namespace

void NewtonSolver::clear() {
  movers_.clear();
  inertias_.clear();
  free_.clear();
  velocities_.clear();
  recovery_.clear();
  numbers_.clear();
  contacts_.clear();
  limited_.clear();
}

int NewtonSolver::add_mover(int count) {
  const int begin = static_cast<int>(velocities_.size());
  movers_.push_back({begin, count, inertias_.size(), 0, 0});
  const auto size = static_cast<std::size_t>(begin + count);
  inertias_.resize(inertias_.size() + static_cast<std::size_t>(count * count), 0.0);
  free_.resize(size, 0.0);
  velocities_.resize(size, 0.0);
  recovery_.resize(size, 0.0);
  return static_cast<int>(movers_.size()) - 1;
}

void NewtonSolver::add_sides(RowSides& sides, int a, int b, int rows) {
  sides.a = a;
  sides.b = b == a ? -1 : b;
  const auto add = [&](int mover, std::size_t& begin) {
    begin = numbers_.size();
    if (mover >= 0) numbers_.resize(begin + static_cast<std::size_t>(rows * count(mover)), 0.0);
  };
  add(sides.a, sides.of_a);
  add(sides.b, sides.of_b);
}

ContactRows& NewtonSolver::add_contact(int a, int b) {
  contacts_.emplace_back();
  add_sides(contacts_.back(), a, b, 3);
  return contacts_.back();
}

LimitedRow& NewtonSolver::add_limited(int a, int b) {
  limited_.emplace_back();
  add_sides(limited_.back(), a, b, 1);
  return limited_.back();
}

double NewtonSolver::inverse_mass(const RowSides& sides, int row) const {
  double sum = 0.0;
  const auto add = [&](int index, std::size_t begin) {
    if (index < 0) return;
    const Mover& mover = movers_[static_cast<std::size_t>(index)];
    const double* jacobian = numbers_.data() + begin + row * mover.count;
    const double* inertia = inertias_.data() + mover.inertia;
    for (int i = 0; i < mover.count; ++i) {
      if (jacobian[i] != 0.0) sum += jacobian[i] * jacobian[i] / inertia[i * mover.count + i];
    }
  };
  add(sides.a, sides.of_a);
  add(sides.b, sides.of_b);
  return sum;
}

double NewtonSolver::speed(const RowSides& sides, int row, const std::vector<double>& velocities) const {
  double sum = 0.0;
  const auto add = [&](int index, std::size_t begin) {
    if (index < 0) return;
    const Mover& mover = movers_[static_cast<std::size_t>(index)];
    sum += dot(numbers_.data() + begin + row * mover.count, velocities.data() + mover.begin, mover.count);
  };
  add(sides.a, sides.of_a);
  add(sides.b, sides.of_b);
  return sum;
}

int NewtonSolver::root(int mover) {
  while (parents_[static_cast<std::size_t>(mover)] != mover) {
    int& parent = parents_[static_cast<std::size_t>(mover)];
    parent = parents_[static_cast<std::size_t>(parent)];
    mover = parent;
  }
  return mover;
}

// The root is the first mover of an island.
void NewtonSolver::join(const RowSides& sides) {
  if (sides.a < 0 || sides.b < 0) return;
  const int a = root(sides.a);
  const int b = root(sides.b);
  parents_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
}

void NewtonSolver::find_islands() {
  parents_.resize(movers_.size());
  std::iota(parents_.begin(), parents_.end(), 0);
  for (const ContactRows& rows : contacts_) join(rows);
  for (const LimitedRow& row : limited_) join(row);
  island_count_ = 0;
  for (std::size_t i = 0; i < movers_.size(); ++i) {
    const int first = root(static_cast<int>(i));
    if (first == static_cast<int>(i)) {
      movers_[i].island = static_cast<int>(island_count_++);
      if (islands_.size() < island_count_) islands_.emplace_back();
      Island& island = islands_[island_count_ - 1];
      island.movers.clear();
      island.contacts.clear();
      island.limited.clear();
    } else {
      movers_[i].island = movers_[static_cast<std::size_t>(first)].island;
    }
    islands_[static_cast<std::size_t>(movers_[i].island)].movers.push_back(static_cast<int>(i));
  }
  const auto island_of = [&](const RowSides& sides) -> Island& {
    const auto mover = static_cast<std::size_t>(sides.a >= 0 ? sides.a : sides.b);
    return islands_[static_cast<std::size_t>(movers_[mover].island)];
  };
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    if (contacts_[i].a < 0 && contacts_[i].b < 0) continue;
    island_of(contacts_[i]).contacts.push_back(static_cast<int>(i));
  }
  for (std::size_t i = 0; i < limited_.size(); ++i) {
    island_of(limited_[i]).limited.push_back(static_cast<int>(i));
  }
}

// Rows of the matrix. Many movers are taken in the order of Cuthill and McKee (1969), for a narrow envelope.
void NewtonSolver::order(Island& island) {
  const std::size_t count = island.movers.size();
  constexpr std::size_t few = 4;
  if (count > few) {
    std::vector<std::vector<int>> neighbours(movers_.size());
    const auto connect = [&](const RowSides& sides) {
      if (sides.a < 0 || sides.b < 0) return;
      neighbours[static_cast<std::size_t>(sides.a)].push_back(sides.b);
      neighbours[static_cast<std::size_t>(sides.b)].push_back(sides.a);
    };
    for (const int i : island.contacts) connect(contacts_[static_cast<std::size_t>(i)]);
    for (const int i : island.limited) connect(limited_[static_cast<std::size_t>(i)]);
    for (const int i : island.movers) {
      auto& of = neighbours[static_cast<std::size_t>(i)];
      std::sort(of.begin(), of.end());
      of.erase(std::unique(of.begin(), of.end()), of.end());
    }
    const auto fewer = [&](int a, int b) {
      return neighbours[static_cast<std::size_t>(a)].size() < neighbours[static_cast<std::size_t>(b)].size();
    };
    std::vector<bool> seen(movers_.size(), false);
    std::vector<int> ordered;
    const int start = *std::min_element(island.movers.begin(), island.movers.end(), fewer);
    ordered.push_back(start);
    seen[static_cast<std::size_t>(start)] = true;
    for (std::size_t next = 0; next < ordered.size(); ++next) {
      auto& of = neighbours[static_cast<std::size_t>(ordered[next])];
      std::stable_sort(of.begin(), of.end(), fewer);
      for (const int other : of) {
        if (seen[static_cast<std::size_t>(other)]) continue;
        seen[static_cast<std::size_t>(other)] = true;
        ordered.push_back(other);
      }
    }
    island.movers = ordered;
  }
  int size = 0;
  for (const int i : island.movers) {
    movers_[static_cast<std::size_t>(i)].local = size;
    size += movers_[static_cast<std::size_t>(i)].count;
  }
  first_.resize(static_cast<std::size_t>(size));
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    std::fill_n(first_.begin() + mover.local, mover.count, mover.local);
  }
  const auto widen = [&](const RowSides& sides) {
    if (sides.a < 0 || sides.b < 0) return;
    const Mover* low = &movers_[static_cast<std::size_t>(sides.a)];
    const Mover* high = &movers_[static_cast<std::size_t>(sides.b)];
    if (low->local > high->local) std::swap(low, high);
    for (int i = 0; i < high->count; ++i) {
      int& first = first_[static_cast<std::size_t>(high->local + i)];
      first = std::min(first, low->local);
    }
  };
  for (const int i : island.contacts) widen(contacts_[static_cast<std::size_t>(i)]);
  for (const int i : island.limited) widen(limited_[static_cast<std::size_t>(i)]);
}

bool NewtonSolver::solve(int iterations, double tolerance) {
  COUNT(3,(long)contacts_.size()); find_islands();
  const std::size_t size = velocities_.size();
  for (std::vector<double>* numbers : {&residual_, &turnover_, &direction_}) numbers->resize(size);
  misses_.resize(contacts_.size());
  miss_changes_.resize(contacts_.size());
  responses_.resize(contacts_.size());
  shifts_.resize(contacts_.size());
  limited_misses_.resize(limited_.size());
  limited_changes_.resize(limited_.size());
  limited_slopes_.resize(limited_.size());
  iterations_ = 0;
  bool converged = true;
  for (std::size_t i = 0; i < island_count_; ++i) {
    Island& island = islands_[i];
    if (island.contacts.empty() && island.limited.empty()) {
      for (const int mover : island.movers) std::copy_n(free(mover), count(mover), velocities(mover));
      continue;
    }
    order(island);
    const bool solved = solve(island, iterations, tolerance);
    converged = converged && solved;
    for (const int k : island.contacts) {
      contacts_[static_cast<std::size_t>(k)].impulse = responses_[static_cast<std::size_t>(k)].impulse;
    }
    for (const int k : island.limited) {
      LimitedRow& row = limited_[static_cast<std::size_t>(k)];
      row.impulse = limited_impulse(row, limited_misses_[static_cast<std::size_t>(k)]);
    }
    if (solved) balance(island);  // what is left of an error would be blown up
    recover(island);
  }
  return converged;
}

bool NewtonSolver::solve(Island& island, int iterations, double tolerance) {
  int left = iterations;
  double error = coulomb_error(island);
  TRACE("start %g |", error);
  while (error > tolerance && left > 0) {
    saved_ = velocities_;
    double next = error;
    int tries = 0;
    while (tries < patience && left > 0 && find_direction(island)) {
      COUNT(0,1); add_step(island, 1.0);
      --left;
      ++tries;
      next = coulomb_error(island);
      TRACE(" C%.1e", next);
      if (next < enough * error || next <= tolerance) break;
    }
    if (next < enough * error || next <= tolerance) {
      error = next;
      continue;
    }
    velocities_.swap(saved_);
    coulomb_error(island);
    if (!find_start(island, left, tolerance)) break;
    error = coulomb_error(island);
  }
  iterations_ += iterations - left;
  TRACE("\n");
  return error <= tolerance;
}

// Residual of the equations, turnover of its terms, and responses, at the velocities.
template <typename Respond>
double NewtonSolver::evaluate(const Island& island, const Respond& respond) {
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    const double* inertia = inertias_.data() + mover.inertia;
    const double* velocities = velocities_.data() + mover.begin;
    const double* free = free_.data() + mover.begin;
    double changes[64];
    std::vector<double> many;
    double* change = changes;
    if (mover.count > 64) {
      many.resize(static_cast<std::size_t>(mover.count));
      change = many.data();
    }
    for (int j = 0; j < mover.count; ++j) change[j] = velocities[j] - free[j];
    for (int j = 0; j < mover.count; ++j) {
      const double momentum = dot(inertia + j * mover.count, change, mover.count);
      residual_[static_cast<std::size_t>(mover.begin + j)] = momentum;
      turnover_[static_cast<std::size_t>(mover.begin + j)] = std::abs(momentum);
    }
  }
  const auto take = [&](int index, std::size_t begin, const double* impulse, int rows) {
    if (index < 0) return;
    const Mover& mover = movers_[static_cast<std::size_t>(index)];
    const double* jacobian = numbers_.data() + begin;
    double* residual = residual_.data() + mover.begin;
    double* turnover = turnover_.data() + mover.begin;
    for (int j = 0; j < mover.count; ++j) {
      double sum = 0.0;
      for (int row = 0; row < rows; ++row) sum += jacobian[row * mover.count + j] * impulse[row];
      residual[j] -= sum;
      turnover[j] += std::abs(sum);
    }
  };
  for (const int i : island.contacts) {
    const auto k = static_cast<std::size_t>(i);
    const ContactRows& rows = contacts_[k];
    for (int row = 0; row < 3; ++row) {
      misses_[k][static_cast<std::size_t>(row)] =
          rows.target[static_cast<std::size_t>(row)] - speed(rows, row, velocities_);
    }
    respond(k);
    if (responses_[k].open) continue;
    take(rows.a, rows.of_a, responses_[k].impulse.data(), 3);
    take(rows.b, rows.of_b, responses_[k].impulse.data(), 3);
  }
  for (const int i : island.limited) {
    const auto k = static_cast<std::size_t>(i);
    const LimitedRow& row = limited_[k];
    limited_misses_[k] = row.target - speed(row, 0, velocities_);
    limited_slopes_[k] = limited_slope(row, limited_misses_[k]);
    const double impulse = limited_impulse(row, limited_misses_[k]);
    take(row.a, row.of_a, &impulse, 1);
    take(row.b, row.of_b, &impulse, 1);
  }
  return error(island);
}

double NewtonSolver::coulomb_error(const Island& island) {
  return evaluate(island, [this](std::size_t k) { coulomb(contacts_[k].law, misses_[k], responses_[k]); });
}

double NewtonSolver::convex_error(const Island& island) {
  return evaluate(island, [this](std::size_t k) { convex(softened(contacts_[k].law), misses_[k], shifts_[k], responses_[k]); });
}

// The largest residual of a mover as a share of what is turned over there, in units of its inertia.
double NewtonSolver::error(const Island& island) const {
  double worst = 0.0;
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    const double* inertia = inertias_.data() + mover.inertia;
    double error = 0.0, turnover = 0.0;
    for (int j = 0; j < mover.count; ++j) {
      const auto index = static_cast<std::size_t>(mover.begin + j);
      const double mass = inertia[j * mover.count + j];
      const double momentum = mass * (std::abs(velocities_[index]) + std::abs(free_[index]));
      error = std::max(error, std::max(0.0, std::abs(residual_[index]) - rounding_share * momentum) *
                                  std::max(0.0, std::abs(residual_[index]) - rounding_share * momentum) / mass);
      turnover = std::max(turnover, turnover_[index] * turnover_[index] / mass);
    }
    if (error > 0.0) worst = std::max(worst, error / turnover);
  }
  return std::isnan(worst) ? std::numeric_limits<double>::infinity() : std::sqrt(worst);
}

FrictionLaw NewtonSolver::softened(const FrictionLaw& law) const {
  return {law.friction, softening_ * law.tangential_softness, softening_ * law.normal_softness};
}

// Softer contacts have a cost of fewer kinks: so they are stiffened one after the other.
bool NewtonSolver::find_start(const Island& island, int& left, double tolerance) {
  bool moved = false;
  for (const double softening : softenings) {
    softening_ = softening;
    const double to = softening > 1.0 ? soft_tolerance : std::max(convex_tolerance, tolerance);
    moved = convex_descent(island, left, to) || moved;
  }
  softening_ = 1.0;
  return moved;
}

void NewtonSolver::freeze_shifts(const Island& island) {
  for (const int i : island.contacts) {
    const auto k = static_cast<std::size_t>(i);
    shifts_[k] = shift_of(contacts_[k].law, misses_[k]);
  }
}

// Newton's method with a line search on the convex law. False where it gets no further.
bool NewtonSolver::convex_descent(const Island& island, int& left, double tolerance) {
  COUNT(2,1); freeze_shifts(island);
  double error = convex_error(island);
  bool moved = false;
  while (error > tolerance && left > 0) {
    if (!find_direction(island)) return moved;
    const double length = line_search(island);
    if (length == 0.0) return moved;
    COUNT(1,1); add_step(island, length);
    --left;
    error = convex_error(island);
    TRACE(" x%.1e(%.2g)", error, length);
    moved = true;
  }
  return moved;
}

bool NewtonSolver::find_direction(const Island& island) {
  assemble(island);
  if (!matrix_.factor()) return false;
  std::vector<double>& direction = direction_;
  double locals[64];
  std::vector<double> many;
  double* local = locals;
  if (first_.size() > 64) {
    many.resize(first_.size());
    local = many.data();
  }
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    for (int j = 0; j < mover.count; ++j) local[mover.local + j] = -residual_[static_cast<std::size_t>(mover.begin + j)];
  }
  matrix_.solve(local);
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    std::copy_n(local + mover.local, mover.count, direction.begin() + mover.begin);
  }
  return true;
}

void NewtonSolver::assemble(const Island& island) {
  matrix_.reset(first_);
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    const double* inertia = inertias_.data() + mover.inertia;
    for (int j = 0; j < mover.count; ++j) {
      std::copy_n(inertia + j * mover.count, mover.count, matrix_.row(mover.local + j) + mover.local);
    }
  }
  for (const int i : island.contacts) {
    const auto k = static_cast<std::size_t>(i);
    if (!responses_[k].open) add_block(contacts_[k], 3, responses_[k].slope[0].data());
  }
  for (const int i : island.limited) {
    const auto k = static_cast<std::size_t>(i);
    if (limited_slopes_[k] != 0.0) add_block(limited_[k], 1, &limited_slopes_[k]);
  }
}

// Adds J' slope J.
void NewtonSolver::add_block(const RowSides& sides, int rows, const double* slope) {
  const auto add = [&](int left, std::size_t of_left, int right, std::size_t of_right) {
    if (left < 0 || right < 0) return;
    const Mover& from = movers_[static_cast<std::size_t>(left)];
    const Mover& to = movers_[static_cast<std::size_t>(right)];
    const double* of_from = numbers_.data() + of_left;
    const double* of_to = numbers_.data() + of_right;
    for (int i = 0; i < from.count; ++i) {
      double* const entries = matrix_.row(from.local + i) + to.local;
      for (int row = 0; row < rows; ++row) {
        double along = 0.0;
        for (int m = 0; m < rows; ++m) along += of_from[m * from.count + i] * slope[m * rows + row];
        if (along == 0.0) continue;
        const double* const jacobian = of_to + row * to.count;
        for (int j = 0; j < to.count; ++j) entries[j] += along * jacobian[j];
      }
    }
  };
  add(sides.a, sides.of_a, sides.a, sides.of_a);
  add(sides.a, sides.of_a, sides.b, sides.of_b);
  add(sides.b, sides.of_b, sides.a, sides.of_a);
  add(sides.b, sides.of_b, sides.b, sides.of_b);
}

// The length at which the convex cost is lowest along the direction, or nearly so: Newton's method within a bracket.
double NewtonSolver::line_search(const Island& island) {
  double constant = 0.0, linear = 0.0;  // of the slope of the inertia's part
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    const double* inertia = inertias_.data() + mover.inertia;
    const double* direction = direction_.data() + mover.begin;
    for (int j = 0; j < mover.count; ++j) {
      const double momentum = dot(inertia + j * mover.count, direction, mover.count);
      linear += momentum * direction[j];
      constant += momentum * (velocities_[static_cast<std::size_t>(mover.begin + j)] -
                              free_[static_cast<std::size_t>(mover.begin + j)]);
    }
  }
  for (const int i : island.contacts) {
    const auto k = static_cast<std::size_t>(i);
    for (int row = 0; row < 3; ++row) {
      miss_changes_[k][static_cast<std::size_t>(row)] = -speed(contacts_[k], row, direction_);
    }
  }
  for (const int i : island.limited) {
    const auto k = static_cast<std::size_t>(i);
    limited_changes_[k] = -speed(limited_[k], 0, direction_);
  }
  const auto slope = [&](double length, double& bend) {
    double sum = constant + linear * length;
    bend = linear;
    ContactResponse response;
    for (const int i : island.contacts) {
      const auto k = static_cast<std::size_t>(i);
      const ContactVector& change = miss_changes_[k];
      ContactVector miss = misses_[k];
      for (std::size_t row = 0; row < 3; ++row) miss[row] += length * change[row];
      convex(softened(contacts_[k].law), miss, shifts_[k], response);
      if (response.open) continue;
      for (std::size_t row = 0; row < 3; ++row) {
        sum += response.impulse[row] * change[row];
        for (std::size_t m = 0; m < 3; ++m) bend += change[row] * response.slope[row][m] * change[m];
      }
    }
    for (const int i : island.limited) {
      const auto k = static_cast<std::size_t>(i);
      const double miss = limited_misses_[k] + length * limited_changes_[k];
      sum += limited_impulse(limited_[k], miss) * limited_changes_[k];
      bend += limited_slope(limited_[k], miss) * limited_changes_[k] * limited_changes_[k];
    }
    return sum;
  };
  double bend = 0.0;
  const double at_start = slope(0.0, bend);
  if (!(at_start < 0.0)) return 0.0;
  double low = 0.0, high = std::numeric_limits<double>::infinity(), length = 1.0;
  for (int i = 0; i < most_trials; ++i) {
    const double now = slope(length, bend);
    if (std::abs(now) <= -flat_share * at_start) break;
    (now < 0.0 ? low : high) = length;
    double next = length - now / bend;
    if (!(next > low && next < high)) next = std::isinf(high) ? 2.0 * length : 0.5 * (low + high);
    length = next;
  }
  return length;
}

void NewtonSolver::add_step(const Island& island, double length) {
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    for (int j = mover.begin; j < mover.begin + mover.count; ++j) {
      velocities_[static_cast<std::size_t>(j)] += length * direction_[static_cast<std::size_t>(j)];
    }
  }
}

// Takes the rest of the residual out, mover by mover: so velocities change by the impulses to the last digit, and what
// one body gives another one gets.
void NewtonSolver::balance(const Island& island) {
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    const int count = mover.count;
    double* const velocities = velocities_.data() + mover.begin;
    double* const rest = residual_.data() + mover.begin;
    factors_.assign(inertias_.begin() + static_cast<std::ptrdiff_t>(mover.inertia),
                    inertias_.begin() + static_cast<std::ptrdiff_t>(mover.inertia) + count * count);
    double* const m = factors_.data();
    for (int k = 0; k < count; ++k) {  // L D L' by columns; linear ones stand alone
      for (int j = k + 1; j < count; ++j) {
        const double factor = m[j * count + k] / m[k * count + k];
        if (factor == 0.0) continue;
        for (int l = j; l < count; ++l) m[l * count + j] -= factor * m[l * count + k];
        rest[j] -= factor * rest[k];
      }
    }
    for (int k = count; k-- > 0;) {
      double sum = rest[k];
      for (int j = k + 1; j < count; ++j) sum -= m[j * count + k] * rest[j];
      rest[k] = sum / m[k * count + k];
      velocities[k] -= rest[k];
    }
  }
}

// How the velocities would answer if overlapping bodies were asked to part by their `recovery` faster, while everything
// that presses or sticks goes on doing so. It moves them, and speeds up nothing.
void NewtonSolver::recover(const Island& island) {
  const auto overlaps = [](const auto& rows) { return rows.recovery > 0.0; };
  const bool any =
      std::any_of(island.contacts.begin(), island.contacts.end(),
                  [&](int k) { return overlaps(contacts_[static_cast<std::size_t>(k)]); }) ||
      std::any_of(island.limited.begin(), island.limited.end(),
                  [&](int k) { return overlaps(limited_[static_cast<std::size_t>(k)]); });
  if (!any) return;
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    std::fill_n(residual_.begin() + mover.begin, mover.count, 0.0);
  }
  const auto press = [&](int index, std::size_t begin, int row, double impulse) {
    if (index < 0) return;
    const Mover& mover = movers_[static_cast<std::size_t>(index)];
    const double* jacobian = numbers_.data() + begin + row * mover.count;
    for (int j = 0; j < mover.count; ++j) residual_[static_cast<std::size_t>(mover.begin + j)] -= jacobian[j] * impulse;
  };
  for (const int i : island.contacts) {
    const auto k = static_cast<std::size_t>(i);
    const ContactRows& rows = contacts_[k];
    const double leaving = std::max(0.0, rows.target[2] - misses_[k][2]) ;
    const double asked = std::max(0.0, rows.recovery - leaving);
    ContactResponse& response = responses_[k];
    response.open = !(rows.impulse[2] > 0.0 || asked > 0.0);
    if (response.open) continue;
    const double tangential = rows.law.friction > 0.0 ? 1.0 / rows.law.tangential_softness : 0.0;
    const double normal = 1.0 / rows.law.normal_softness;
    response.slope = {{{tangential, 0.0, 0.0}, {0.0, tangential, 0.0}, {0.0, 0.0, normal}}};
    press(rows.a, rows.of_a, 2, normal * asked);
    press(rows.b, rows.of_b, 2, normal * asked);
  }
  for (const int i : island.limited) {
    const auto k = static_cast<std::size_t>(i);
    const LimitedRow& row = limited_[k];
    if (row.recovery <= 0.0) continue;
    limited_slopes_[k] = 1.0 / row.softness;
    press(row.a, row.of_a, 0, row.recovery / row.softness);
    press(row.b, row.of_b, 0, row.recovery / row.softness);
  }
  if (!find_direction(island)) return;
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    std::copy_n(direction_.begin() + mover.begin, mover.count, recovery_.begin() + mover.begin);
  }
}

}  // namespace energymargin
