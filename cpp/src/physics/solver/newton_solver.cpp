#include "physics/solver/newton_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace energymargin {
namespace {

// So many iterations have to leave less than this share of the error.
constexpr double enough = 0.5;
constexpr int patience = 6;

// Sweeps at first, and most at a time; and iterations that go on from them.
constexpr int first_sweeps = 16;
constexpr int most_sweeps = 128;
constexpr int most_after_sweeps = 16;

// The first of these are whole steps; later, of which most have gone in circles, only every third.
constexpr int whole_steps = 3;
constexpr double shorter_step = 0.6;

// Errors are told as a share of the impulses, or of this share of the momenta where impulses are next to nothing.
constexpr double least_turnover = 1e-3;

// A load that presses contacts in by more than this is borne by harder ones [m/s].
constexpr double most_given = 0.01;
constexpr double most_harder = 20.0;

double dot(const double* a, const double* b, int count) {
  if (count == usual_count) {
    return ((a[0] * b[0] + a[2] * b[2]) + a[4] * b[4]) + ((a[1] * b[1] + a[3] * b[3]) + a[5] * b[5]);
  }
  double sum = 0.0;
  for (int i = 0; i < count; ++i) sum += a[i] * b[i];
  return sum;
}

// entries += factor * row
template <int known>
void add_multiple(double factor, const double* __restrict row, int count, double* __restrict entries) {
  const int length = known > 0 ? known : count;
  for (int j = 0; j < length; ++j) entries[j] += factor * row[j];
}

void add_multiple(double factor, const double* row, int count, double* entries) {
  if (count == usual_count) return add_multiple<usual_count>(factor, row, count, entries);
  add_multiple<0>(factor, row, count, entries);
}

// Of a contact on a free body, the three rows of a Jacobian.
constexpr int contact_size = 3 * usual_count;

// Speeds along the rows.
void add_speeds(const double* jacobian, const double* velocities, ContactVector& speeds) {
  for (std::size_t row = 0; row < 3; ++row) speeds[row] += dot(jacobian + row * usual_count, velocities, usual_count);
}

// Impulses along the rows.
void take_contact(const double* __restrict jacobian, const double* __restrict impulse, double* __restrict residual,
                  double* __restrict turnover) {
  for (int j = 0; j < usual_count; ++j) {
    const double sum =
        impulse[0] * jacobian[j] + impulse[1] * jacobian[usual_count + j] + impulse[2] * jacobian[2 * usual_count + j];
    residual[j] -= sum;
    turnover[j] += std::abs(sum);
  }
}

// slope x rows: nothing that friction does presses.
void answer_contact(const ContactResponse& response, const double* __restrict rows, double* __restrict answer) {
  const auto& [x, y, normal] = response.slope;
  if (response.regime == Regime::sticks) {
    for (int j = 0; j < usual_count; ++j) {
      answer[j] = x[0] * rows[j];
      answer[usual_count + j] = y[1] * rows[usual_count + j];
      answer[2 * usual_count + j] = normal[2] * rows[2 * usual_count + j];
    }
    return;
  }
  for (int j = 0; j < usual_count; ++j) {
    const double along_x = rows[j], along_y = rows[usual_count + j], along_normal = rows[2 * usual_count + j];
    answer[j] = x[0] * along_x + x[1] * along_y + x[2] * along_normal;
    answer[usual_count + j] = y[0] * along_x + y[1] * along_y + y[2] * along_normal;
    answer[2 * usual_count + j] = normal[2] * along_normal;
  }
}

// entries += along' x rows
void add_contact_row(const double* __restrict along, const double* __restrict rows, double* __restrict entries) {
  const double x = along[0], y = along[usual_count], normal = along[2 * usual_count];
  for (int j = 0; j < usual_count; ++j) {
    entries[j] += x * rows[j] + y * rows[usual_count + j] + normal * rows[2 * usual_count + j];
  }
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
  inverse_diagonal_.clear();
  kept_ = 0;
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

// Of movers that are new.
void NewtonSolver::keep_diagonals() {
  for (; kept_ < movers_.size(); ++kept_) {
    const Mover& mover = movers_[kept_];
    for (int i = 0; i < mover.count; ++i) {
      inverse_diagonal_.push_back(1.0 / inertias_[mover.inertia + static_cast<std::size_t>(i * mover.count + i)]);
    }
  }
}

void NewtonSolver::add_sides(RowSides& sides, int a, int b, int rows) {
  keep_diagonals();
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
    const double* inverses = inverse_diagonal_.data() + mover.begin;
    for (int i = 0; i < mover.count; ++i) {
      sum += jacobian[i] * jacobian[i] * inverses[i];
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

ContactVector NewtonSolver::speeds(const ContactRows& rows, const std::vector<double>& velocities) const {
  ContactVector sums{};
  const auto add = [&](int index, std::size_t begin) {
    if (index < 0) return;
    const Mover& mover = movers_[static_cast<std::size_t>(index)];
    const double* const jacobian = numbers_.data() + begin;
    const double* const of_mover = velocities.data() + mover.begin;
    if (mover.count == usual_count) return add_speeds(jacobian, of_mover, sums);
    for (std::size_t row = 0; row < 3; ++row) {
      sums[row] += dot(jacobian + row * static_cast<std::size_t>(mover.count), of_mover, mover.count);
    }
  };
  add(rows.a, rows.of_a);
  add(rows.b, rows.of_b);
  return sums;
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
  island.first.resize(static_cast<std::size_t>(size));
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    std::fill_n(island.first.begin() + mover.local, mover.count, mover.local);
  }
  const auto widen = [&](const RowSides& sides) {
    if (sides.a < 0 || sides.b < 0) return;
    const Mover* low = &movers_[static_cast<std::size_t>(sides.a)];
    const Mover* high = &movers_[static_cast<std::size_t>(sides.b)];
    if (low->local > high->local) std::swap(low, high);
    for (int i = 0; i < high->count; ++i) {
      int& first = island.first[static_cast<std::size_t>(high->local + i)];
      first = std::min(first, low->local);
    }
  };
  for (const int i : island.contacts) widen(contacts_[static_cast<std::size_t>(i)]);
  for (const int i : island.limited) widen(limited_[static_cast<std::size_t>(i)]);
}

bool NewtonSolver::solve(int iterations, double tolerance) {
  find_islands();
  for (std::size_t i = 0; i < island_count_; ++i) {
    if (!islands_[i].free()) order(islands_[i]);
  }
  return solve_again(iterations, tolerance);
}

bool NewtonSolver::solve_again(int iterations, double tolerance) {
  const std::size_t size = velocities_.size();
  for (std::vector<double>* numbers : {&residual_, &turnover_, &direction_}) numbers->resize(size);
  misses_.resize(contacts_.size());
  responses_.resize(contacts_.size());
  directions_.resize(contacts_.size());
  limited_misses_.resize(limited_.size());
  limited_slopes_.resize(limited_.size());
  iterations_ = 0;
  bool converged = true;
  for (std::size_t i = 0; i < island_count_; ++i) {
    Island& island = islands_[i];
    if (island.free()) {
      for (const int mover : island.movers) std::copy_n(free(mover), count(mover), velocities(mover));
      continue;
    }
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

void NewtonSolver::save(const Island& island) {
  saved_.resize(velocities_.size());
  for (const int i : island.movers) std::copy_n(velocities(i), count(i), saved_.data() + begin(i));
}

// Contacts that give way by more than that are made as much harder as it takes, and not by more than `most_harder`:
// where walls close on a body nothing helps. Whether there were any.
bool NewtonSolver::harden(const Island& island) {
  bool any = false;
  for (const int c : island.contacts) {
    const auto k = static_cast<std::size_t>(c);
    FrictionLaw& law = contacts_[k].law;
    const double gives = law.normal_softness * responses_[k].impulse[2];
    if (!(gives > most_given)) continue;
    const double share = std::max(0.5 * most_given / gives, 1.0 / most_harder);
    law.normal_softness *= share;
    law.tangential_softness *= share;
    any = true;
  }
  return any;
}

bool NewtonSolver::solve(Island& island, int iterations, double tolerance) {
  int left = iterations;
  int sweeps = 0;
  double error = coulomb_error(island, false);
  bool hardened = false;
  while (true) {
    if (error <= tolerance) {
      if (hardened || !harden(island)) break;
      hardened = true;
      error = coulomb_error(island, false);
      continue;
    }
    if (left == 0) break;
    save(island);
    double next = error;
    for (int tries = 0; tries < patience && left > 0 && find_direction(island); ++tries) {
      keep_directions(island);
      add_step(island, 1.0);
      --left;
      next = coulomb_error(island, true);
      if (next <= tolerance && stopped_) next = coulomb_error(island, false);
      if (next < enough * error || next <= tolerance) break;
    }
    if (next < enough * error || next <= tolerance) {
      error = next;
      continue;
    }
    if (left == 0) break;
    for (const int i : island.movers) std::copy_n(saved_.data() + begin(i), count(i), velocities(i));
    sweeps = sweeps == 0 ? first_sweeps : std::min(2 * sweeps, most_sweeps);
    --left;
    error = go_on_from_sweeps(island, sweeps, left, tolerance);
  }
  iterations_ += iterations - left;
  if (error <= tolerance) return true;
  if (sweeps == 0) {
    start_sweeps(island);
    sweep(island, first_sweeps);
  }
  take_swept(island);
  return false;
}

// Residual of the equations, turnover of its terms, and responses, at the velocities.
template <typename Respond>
double NewtonSolver::evaluate(const Island& island, const Respond& respond) {
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    const double* inertia = inertias_.data() + mover.inertia;
    const double* velocities = velocities_.data() + mover.begin;
    const double* free = free_.data() + mover.begin;
    changes_.resize(static_cast<std::size_t>(mover.count));
    double* const change = changes_.data();
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
    if (mover.count == usual_count && rows == 3) return take_contact(jacobian, impulse, residual, turnover);
    for (int j = 0; j < mover.count; ++j) {
      double sum = 0.0;
      for (int row = 0; row < rows; ++row) sum += impulse[row] * jacobian[row * mover.count + j];
      residual[j] -= sum;
      turnover[j] += std::abs(sum);
    }
  };
  for (const int i : island.contacts) {
    const auto k = static_cast<std::size_t>(i);
    const ContactRows& rows = contacts_[k];
    const ContactVector speeds_now = speeds(rows, velocities_);
    for (std::size_t row = 0; row < 3; ++row) misses_[k][row] = rows.target[row] - speeds_now[row];
    respond(k);
    if (responses_[k].regime == Regime::open) continue;
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

// After a step, what slid and would go on the other way has stopped on the way: it sticks, before one can tell.
double NewtonSolver::coulomb_error(const Island& island, bool after_step) {
  stopped_ = false;
  return evaluate(island, [this, after_step](std::size_t k) {
    const ContactVector& miss = misses_[k];
    const auto& [x, y] = directions_[k];
    const bool turns_round = after_step && miss[2] > 0.0 && x * miss[0] + y * miss[1] < 0.0;
    if (turns_round) {
      stopped_ = true;
      return respond_as(Regime::sticks, contacts_[k].law, miss, responses_[k]);
    }
    coulomb(contacts_[k].law, miss, responses_[k]);
  });
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
      const double turned = std::max(turnover_[index], least_turnover * momentum);
      const double inverse = inverse_diagonal_[index];
      const double squared = residual_[index] * residual_[index] * inverse;
      if (!(squared <= error)) error = squared;  // also what is no number
      turnover = std::max(turnover, turned * turned * inverse);
    }
    if (error != 0.0 && !(error / turnover <= worst)) worst = error / turnover;
  }
  return std::isnan(worst) ? std::numeric_limits<double>::infinity() : std::sqrt(worst);
}

// Of what slides, before a step.
void NewtonSolver::keep_directions(const Island& island) {
  for (const int i : island.contacts) {
    const auto k = static_cast<std::size_t>(i);
    directions_[k] = {0.0, 0.0};
    if (responses_[k].regime == Regime::slides) directions_[k] = {misses_[k][0], misses_[k][1]};
  }
}

// What velocities answer to impulses along the rows: products with the inverse of each mover's inertia.
void NewtonSolver::prepare_sweeps(const Island& island) {
  inverses_.resize(inertias_.size());
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    const int count = mover.count;
    double* const m = inverses_.data() + mover.inertia;
    std::copy_n(inertias_.data() + mover.inertia, count * count, m);
    for (int k = 0; k < count; ++k) {  // Gauss and Jordan's way; an inertia needs no pivots
      const double inverse = 1.0 / m[k * count + k];
      m[k * count + k] = 1.0;
      for (int j = 0; j < count; ++j) m[k * count + j] *= inverse;
      for (int l = 0; l < count; ++l) {
        const double factor = m[l * count + k];
        if (l == k || factor == 0.0) continue;
        m[l * count + k] = 0.0;
        for (int j = 0; j < count; ++j) m[l * count + j] -= factor * m[k * count + j];
      }
    }
  }
  answers_.clear();
  const auto answer = [&](int index, std::size_t begin, int rows, double* inverse_masses) {
    const std::size_t at = answers_.size();
    if (index < 0) return at;
    const Mover& mover = movers_[static_cast<std::size_t>(index)];
    answers_.resize(at + static_cast<std::size_t>(rows * mover.count));
    for (int row = 0; row < rows; ++row) {
      const double* jacobian = numbers_.data() + begin + row * mover.count;
      double* const of_row = answers_.data() + at + row * mover.count;
      for (int j = 0; j < mover.count; ++j) {
        of_row[j] = dot(inverses_.data() + mover.inertia + j * mover.count, jacobian, mover.count);
      }
      inverse_masses[row] += dot(jacobian, of_row, mover.count);
    }
    return at;
  };
  for (const int i : island.contacts) {
    const ContactRows& rows = contacts_[static_cast<std::size_t>(i)];
    Swept& swept = swept_[static_cast<std::size_t>(i)];
    swept = {};
    swept.of_a = answer(rows.a, rows.of_a, 3, swept.inverse_masses.data());
    swept.of_b = answer(rows.b, rows.of_b, 3, swept.inverse_masses.data());
  }
  for (const int i : island.limited) {
    const LimitedRow& row = limited_[static_cast<std::size_t>(i)];
    SweptRow& swept = swept_rows_[static_cast<std::size_t>(i)];
    swept = {};
    swept.of_a = answer(row.a, row.of_a, 1, &swept.inverse_mass);
    swept.of_b = answer(row.b, row.of_b, 1, &swept.inverse_mass);
  }
}

// With no impulses.
void NewtonSolver::start_sweeps(const Island& island) {
  swept_.resize(contacts_.size());
  swept_rows_.resize(limited_.size());
  predicted_.resize(contacts_.size());
  prepare_sweeps(island);
  swept_velocities_ = velocities_;
  for (const int i : island.movers) std::copy_n(free(i), count(i), swept_velocities_.data() + begin(i));
}

// Sequential impulses from one contact to the next, and every other time the other way round.
void NewtonSolver::sweep(const Island& island, int sweeps) {
  velocities_.swap(swept_velocities_);
  for (int i = 0; i < sweeps; ++i) {
    for (const int k : island.limited) resolve_limited(static_cast<std::size_t>(k));
    if (i % 2 == 0) {
      for (const int k : island.contacts) resolve_contact(static_cast<std::size_t>(k));
    } else {
      for (auto k = island.contacts.rbegin(); k != island.contacts.rend(); ++k) {
        resolve_contact(static_cast<std::size_t>(*k));
      }
    }
  }
  velocities_.swap(swept_velocities_);
}

void NewtonSolver::push(const RowSides& sides, int row, std::size_t of_a, std::size_t of_b, double impulse) {
  const auto add = [&](int index, std::size_t begin) {
    if (index < 0) return;
    const Mover& mover = movers_[static_cast<std::size_t>(index)];
    const double* answer = answers_.data() + begin + row * mover.count;
    double* const velocities = velocities_.data() + mover.begin;
    for (int j = 0; j < mover.count; ++j) velocities[j] += answer[j] * impulse;
  };
  add(sides.a, of_a);
  add(sides.b, of_b);
}

void NewtonSolver::resolve_contact(std::size_t k) {
  const ContactRows& rows = contacts_[k];
  Swept& swept = swept_[k];
  const auto set = [&](int row, double impulse) {
    const double change = impulse - swept.impulse[static_cast<std::size_t>(row)];
    if (change == 0.0) return;
    swept.impulse[static_cast<std::size_t>(row)] = impulse;
    push(rows, row, swept.of_a, swept.of_b, change);
  };
  const auto asked = [&](int row, double softness) {
    const auto i = static_cast<std::size_t>(row);
    const double miss = rows.target[i] - speed(rows, row, velocities_) - softness * swept.impulse[i];
    return swept.impulse[i] + miss / (swept.inverse_masses[i] + softness);
  };
  set(2, std::max(0.0, asked(2, rows.law.normal_softness)));
  if (rows.law.friction == 0.0) return;
  double x = asked(0, rows.law.tangential_softness);
  double y = asked(1, rows.law.tangential_softness);
  const double most = rows.law.friction * swept.impulse[2];
  const double length = std::sqrt(x * x + y * y);
  if (length > most) {
    x *= most / length;
    y *= most / length;
  }
  set(0, x);
  set(1, y);
}

void NewtonSolver::resolve_limited(std::size_t k) {
  const LimitedRow& row = limited_[k];
  SweptRow& swept = swept_rows_[k];
  const double miss = row.target - speed(row, 0, velocities_) - row.softness * swept.impulse;
  const double asked = swept.impulse + miss / (swept.inverse_mass + row.softness);
  const double impulse = std::min(std::max(asked, row.low), row.high);
  push(row, 0, swept.of_a, swept.of_b, impulse - swept.impulse);
  swept.impulse = impulse;
}

// Newton's method from the impulses that the sweeps found. Each step predicts those that the next one starts from.
double NewtonSolver::go_on_from_sweeps(const Island& island, int sweeps, int& left, double tolerance) {
  if (sweeps == first_sweeps) start_sweeps(island);
  sweep(island, sweeps);
  for (const int i : island.movers) {
    std::copy_n(swept_velocities_.data() + begin(i), count(i), velocities(i));
  }
  for (const int i : island.contacts) {
    predicted_[static_cast<std::size_t>(i)] = swept_[static_cast<std::size_t>(i)].impulse;
  }
  double error = std::numeric_limits<double>::infinity();
  for (int i = 0; i < most_after_sweeps && left > 0; ++i) {
    evaluate(island, [this](std::size_t k) { augmented(contacts_[k].law, misses_[k], predicted_[k], responses_[k]); });
    if (!find_direction(island)) return error;
    const double length = i < whole_steps || i % 3 == 2 ? 1.0 : shorter_step;
    for (const int c : island.contacts) {
      const auto k = static_cast<std::size_t>(c);
      ContactVector whole = responses_[k].impulse;
      const ContactVector changes = speeds(contacts_[k], direction_);
      for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 3; ++column) {
          whole[row] -= responses_[k].slope[row][column] * changes[column];
        }
      }
      for (std::size_t row = 0; row < 3; ++row) predicted_[k][row] += length * (whole[row] - predicted_[k][row]);
    }
    add_step(island, length);
    --left;

    error = coulomb_error(island, false);
    if (error <= tolerance) break;
  }
  return error;
}

// Impulses and velocities that belong together, where nothing better was found.
void NewtonSolver::take_swept(const Island& island) {
  for (const int i : island.movers) {
    std::copy_n(swept_velocities_.data() + begin(i), count(i), velocities(i));
  }
  for (const int i : island.contacts) {
    responses_[static_cast<std::size_t>(i)].impulse = swept_[static_cast<std::size_t>(i)].impulse;
  }
  for (const int i : island.limited) {
    const auto k = static_cast<std::size_t>(i);
    limited_misses_[k] = swept_rows_[k].impulse * limited_[k].softness;
  }
}

bool NewtonSolver::find_direction(const Island& island) {
  assemble(island);
  if (!matrix_.factor()) return false;
  std::vector<double>& direction = direction_;
  changes_.resize(island.first.size());
  double* const local = changes_.data();
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    for (int j = 0; j < mover.count; ++j)
      local[mover.local + j] = -residual_[static_cast<std::size_t>(mover.begin + j)];
  }
  matrix_.solve(local);
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    std::copy_n(local + mover.local, mover.count, direction.begin() + mover.begin);
  }
  return true;
}

void NewtonSolver::assemble(const Island& island) {
  matrix_.reset(island.first);
  for (const int i : island.movers) {
    const Mover& mover = movers_[static_cast<std::size_t>(i)];
    const double* inertia = inertias_.data() + mover.inertia;
    for (int j = 0; j < mover.count; ++j) {
      std::copy_n(inertia + j * mover.count, mover.count, matrix_.row(mover.local + j) + mover.local);
    }
  }
  for (const int i : island.contacts) {
    const auto k = static_cast<std::size_t>(i);
    if (responses_[k].regime != Regime::open) add_contact_block(contacts_[k], responses_[k]);
  }
  for (const int i : island.limited) {
    const auto k = static_cast<std::size_t>(i);
    if (limited_slopes_[k] != 0.0) add_limited_block(limited_[k], limited_slopes_[k]);
  }
}

// Adds J' slope J, side by side.
template <typename Add>
void NewtonSolver::add_blocks(const RowSides& sides, const Add& add) {
  if (sides.a >= 0) add(sides.a, sides.of_a, sides.a, sides.of_a);
  if (sides.b < 0) return;
  add(sides.b, sides.of_b, sides.b, sides.of_b);
  if (sides.a < 0) return;
  add(sides.a, sides.of_a, sides.b, sides.of_b);
  add(sides.b, sides.of_b, sides.a, sides.of_a);
}

void NewtonSolver::add_contact_block(const RowSides& sides, const ContactResponse& response) {
  add_blocks(sides, [&](int left, std::size_t of_left, int right, std::size_t of_right) {
    const Mover& from = movers_[static_cast<std::size_t>(left)];
    const Mover& to = movers_[static_cast<std::size_t>(right)];
    const double* const along = numbers_.data() + of_left;
    const double* const jacobian = numbers_.data() + of_right;
    if (from.count == usual_count && to.count == usual_count) {
      double answer[contact_size];
      answer_contact(response, jacobian, answer);
      for (int i = 0; i < usual_count; ++i) {
        add_contact_row(along + i, answer, matrix_.row(from.local + i) + to.local);
      }
      return;
    }
    for (std::size_t row = 0; row < 3; ++row) {
      changes_.assign(static_cast<std::size_t>(to.count), 0.0);
      for (std::size_t k = 0; k < 3; ++k) {
        const double slope = response.slope[row][k];
        const double* const of_row = jacobian + k * static_cast<std::size_t>(to.count);
        if (slope != 0.0) add_multiple(slope, of_row, to.count, changes_.data());
      }
      for (int i = 0; i < from.count; ++i) {
        const double factor = along[row * static_cast<std::size_t>(from.count) + static_cast<std::size_t>(i)];
        if (factor != 0.0) add_multiple(factor, changes_.data(), to.count, matrix_.row(from.local + i) + to.local);
      }
    }
  });
}

void NewtonSolver::add_limited_block(const RowSides& sides, double slope) {
  add_blocks(sides, [&](int left, std::size_t of_left, int right, std::size_t of_right) {
    const Mover& from = movers_[static_cast<std::size_t>(left)];
    const Mover& to = movers_[static_cast<std::size_t>(right)];
    const double* const along = numbers_.data() + of_left;
    for (int i = 0; i < from.count; ++i) {
      if (along[i] == 0.0) continue;
      add_multiple(slope * along[i], numbers_.data() + of_right, to.count, matrix_.row(from.local + i) + to.local);
    }
  });
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
  const bool any = std::any_of(island.contacts.begin(), island.contacts.end(),
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
    const double leaving = std::max(0.0, rows.target[2] - misses_[k][2]);
    const double asked = std::max(0.0, rows.recovery - leaving);
    const bool sticks = responses_[k].regime == Regime::sticks && rows.impulse[2] > 0.0;
    const bool presses = rows.impulse[2] > 0.0 || asked > 0.0;
    FrictionLaw law = rows.law;
    if (!sticks) law.friction = 0.0;
    respond_as(presses ? Regime::sticks : Regime::open, law, {}, responses_[k]);
    if (!presses) continue;
    const double normal = 1.0 / rows.law.normal_softness;
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
