#include "bounds/barrier_bound.hpp"

#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>

#include "bounds/cell_tree.hpp"

namespace energymargin::bounds {
namespace {

constexpr double least_width_share = 1e-6;  // of the domain: no cell is halved below
constexpr int check_share = 16;             // of the cells: so many more, and the way out is looked at as a whole
constexpr double reach_share = 4.0;         // of the object's radius: the domain where the capture set has no end
constexpr double fine = 0.01;    // levels that differ by less are the same: a share of a lift by the object's thickness
constexpr double coarse = 0.05;  // to which levels are known in any case: another share of it
constexpr double most_ratio = 8.0;  // of the widths of cells on a way out that are halved later and earlier
constexpr int least_samples = 8;    // of a way, between two middles
constexpr int most_samples = 4096;
constexpr int looks = 1024;  // cells between two looks at the limit

// The poses that are looked at. What is outside counts as outside of the capture set.
PoseCell domain_of(const Landscape& landscape) {
  const Coordinates start = landscape.space.start();
  const auto [low, high] = landscape.exit.extent;
  const double far = landscape.obstacles.extent_from(start.head<3>()) + reach_share * landscape.space.radius();
  const Vector3 load = landscape.potential.load();
  PoseCell domain{start, start};
  for (int axis = 0; axis < 3; ++axis) {
    const bool idle = load[axis] == 0.0 && !landscape.potential.has_springs() && landscape.obstacles.same_along(axis) &&
                      !landscape.exit.depends_on[static_cast<std::size_t>(axis)];
    if (!landscape.space.free(axis) || idle) continue;
    const double slack = landscape.space.slack(Coordinates::Zero(), Vector3::Zero())[axis];
    domain.low[axis] = std::min(std::isfinite(low[axis]) ? low[axis] - slack : start[axis] - far, start[axis]);
    domain.high[axis] = std::max(std::isfinite(high[axis]) ? high[axis] + slack : start[axis] + far, start[axis]);
  }
  if (landscape.space.free(turn_axis)) {
    domain.low[turn_axis] = -pi;
    domain.high[turn_axis] = pi;
  }
  return domain;
}

// The cells that can be reached from the start, lowest barrier first. Where the flood comes out, a cell of its way is
// halved, and what was reached through it is reached anew: cells are small only where a way out is to be ruled out.
class Flood {
 public:
  Flood(const Landscape& landscape, const FloodBudget& budget)
      : landscape_(landscape), budget_(budget), tree_(landscape, domain_of(landscape)), least_width_(tree_.width(0)) {
    least_width_ *= least_width_share;
    lift_ = landscape.potential.load().norm() * landscape.space.thickness();
    level_ = landscape.potential.start();
  }

  BarrierBound run() {
    BarrierBound bound;
    grow();
    attach(0);
    for (bound.complete = true; !settled(); step()) {
      if (tree_.size() >= budget_.cells || (++looked_ % looks == 0 && budget_.limit.reached())) {
        bound.complete = false;
        break;
      }
    }
    bound.barrier = level_ - landscape_.potential.start();
    bound.cells = tree_.size();
    return bound;
  }

 private:
  // Where the flood is to go next.
  struct Front {
    double level;
    bool uncertain;  // something may be in the way
    double potential;
    int cell, version;
    bool outside;  // it leaves the capture set there

    bool operator<(const Front& other) const {  // the top of the queue is the lowest
      return std::tie(level, uncertain, potential, cell, outside) >
             std::tie(other.level, other.uncertain, other.potential, other.cell, other.outside);
    }
  };

  // How a cell is reached.
  struct Arrival {
    double level = infinity;  // over which [J]
    int from = -1;            // the cell before it on the way
    int version = 0;          // of the two: fronts of another one are out of date
    bool flooded = false;
    std::vector<int> onward;  // cells that are, or were, reached from here
  };

  // Drops fronts that are out of date. True once there is a way out that is good enough, or none.
  bool settled() {
    if (way_out_ >= 0) return true;
    while (!fronts_.empty() && fronts_.top().version != arrivals_[index(fronts_.top().cell)].version) fronts_.pop();
    if (fronts_.empty()) level_ = infinity;
    return fronts_.empty();
  }

  void step() {
    const Front front = fronts_.top();
    fronts_.pop();
    level_ = std::max(level_, front.level);
    if (!front.outside) {
      flood(front);
    } else if (std::vector<int> cells = least_certain(front.cell); !cells.empty()) {
      const std::size_t left = index(budget_.cells - tree_.size() + 1) / 2;
      cells.resize(std::min(cells.size(), left));
      halve(cells);
    } else {
      way_out_ = front.cell;
    }
  }

  void grow() { arrivals_.resize(index(tree_.size())); }

  void reach(int cell, double level, int from) {
    Arrival& arrival = arrivals_[index(cell)];
    const double above = std::max(level, rounded_down(tree_[cell].potential.passed()));
    if (arrival.flooded || above >= arrival.level) return;
    arrival.level = above;
    arrival.from = from;
    ++arrival.version;
    if (from >= 0) arrivals_[index(from)].onward.push_back(cell);
    const Cell& of = tree_[cell];
    fronts_.push({above, !of.occupancy.clear, of.potential.low, cell, arrival.version, false});
  }

  // From the cells around that are flooded, and from the start.
  void attach(int cell) {
    if (tree_.leaf_at(landscape_.space.start()) == cell) reach(cell, landscape_.potential.start(), -1);
    if (tree_[cell].occupancy.blocked) return;
    tree_.neighbours(cell, neighbours_);
    for (const int other : neighbours_) {
      if (arrivals_[index(other)].flooded) reach(cell, arrivals_[index(other)].level, other);
    }
  }

  void flood(const Front& front) {
    arrivals_[index(front.cell)].flooded = true;
    const Cell& cell = tree_[front.cell];
    if (std::isfinite(cell.exit)) leave(front, cell.potential.passed(cell.exit));
    const PoseCell& domain = tree_[0].poses;
    for (int axis = 0; axis < turn_axis; ++axis) {
      if (domain.low[axis] == domain.high[axis]) continue;
      if (cell.poses.low[axis] == domain.low[axis]) {
        leave(front, landscape_.potential.beyond(axis, false, domain.low[axis]));
      }
      if (cell.poses.high[axis] == domain.high[axis]) {
        leave(front, landscape_.potential.beyond(axis, true, domain.high[axis]));
      }
    }
    tree_.neighbours(front.cell, neighbours_);
    for (const int other : neighbours_) reach(other, front.level, front.cell);
  }

  void leave(const Front& front, double level) {
    fronts_.push({std::max(front.level, level), front.uncertain, front.potential, front.cell, front.version, true});
  }

  // The widest cells of a way out in whose middles the object is not free or, if others are far wider, about which
  // anything else is uncertain; none if the way seems to be one.
  std::vector<int> least_certain(int end) {
    std::vector<int> in_the_way, vague;
    for (int cell = end; cell >= 0; cell = arrivals_[index(cell)].from) {
      const Cell& of = tree_[cell];
      if (tree_.width(cell) <= least_width_) continue;
      const bool certain = of.occupancy.clear && cell != end && of.potential.high <= level_ + tolerance();
      if (!certain) (of.occupancy.center_free ? vague : in_the_way).push_back(cell);
    }
    if (in_the_way.empty() && tree_.size() >= next_check_) {
      next_check_ = tree_.size() + tree_.size() / check_share + 1;
      if (tight(end)) return {};
    }
    const bool wide = width(in_the_way) * most_ratio >= width(vague);
    return widest(wide ? in_the_way : vague);
  }

  double width(const std::vector<int>& cells) const {
    double most = 0.0;
    for (const int cell : cells) most = std::max(most, tree_.width(cell));
    return most;
  }

  std::vector<int> widest(std::vector<int> cells) const {
    const double most = width(cells);
    const auto narrow = [&](int cell) { return tree_.width(cell) <= 0.5 * most; };
    cells.erase(std::remove_if(cells.begin(), cells.end(), narrow), cells.end());
    return cells;
  }

  void halve(const std::vector<int>& cells) {
    std::vector<int> lost = cells;
    for (std::size_t i = 0; i < lost.size(); ++i) {
      Arrival& arrival = arrivals_[index(lost[i])];
      for (const int next : arrival.onward) {
        if (arrivals_[index(next)].from == lost[i]) lost.push_back(next);
      }
      const int version = arrival.version + 1;
      arrival = {};
      arrival.version = version;
    }
    for (const int cell : cells) tree_.split(cell);
    grow();
    for (const int cell : lost) {
      if (tree_.leaf(cell)) attach(cell);
    }
    for (const int cell : cells) {
      for (const int half : {0, 1}) attach(tree_[cell].children + half);
    }
  }

  // Whether the way out, through the middles of cells and faces, seems to be one, hardly higher than its level.
  bool tight(int end) const {
    const double start = landscape_.potential.start();
    std::vector<Coordinates> way{outside_pose(tree_[end].poses)};
    for (int cell = end; cell >= 0; cell = arrivals_[index(cell)].from) {
      const PoseCell& poses = tree_[cell].poses;
      const int before = arrivals_[index(cell)].from;
      way.push_back(before < 0 ? landscape_.space.start() : poses.center());
      if (before >= 0) way.push_back(between(poses, tree_[before].poses));
    }
    const double exit = landscape_.exit.crossing({way.front(), way.front()}).outside;
    double highest = std::max(start, middle(way.front()) + exit);
    for (std::size_t i = 0; i + 1 < way.size(); ++i) {
      const int samples = samples_between(way[i], way[i + 1]);
      for (int k = 0; k < samples; ++k) {
        const Coordinates at = way[i] + (k + 0.5) / samples * (way[i + 1] - way[i]);
        if (!landscape_.obstacles.occupancy({at, at}).center_free) return false;
        highest = std::max(highest, middle(at));
      }
    }
    return highest - start <= budget_.enough || highest - level_ <= tolerance();
  }

  // So many that the object is seen in a wall between two poses, however thin it is.
  int samples_between(const Coordinates& a, const Coordinates& b) const {
    const double length = (b - a).head<3>().norm() + std::abs(b[turn_axis] - a[turn_axis]) * landscape_.space.radius();
    const double thickness = landscape_.space.thickness();
    if (!(length < most_samples * thickness)) return most_samples;
    return std::max(least_samples, static_cast<int>(std::ceil(length / thickness)));
  }

  // To which the level is to be known [J].
  double tolerance() const {
    return std::max(budget_.tolerance * (level_ - landscape_.potential.start()), coarse * lift_);
  }

  // Of levels that are nearly the same, ways where nothing is in the way come first.
  double rounded_down(double potential) const {
    const double start = landscape_.potential.start();
    return lift_ > 0.0 ? start + fine * lift_ * std::floor((potential - start) / (fine * lift_)) : potential;
  }

  double middle(const Coordinates& at) const {
    const EnergyRange range = landscape_.potential({at, at});
    return 0.5 * (range.low + range.high);
  }

  // The middle, moved beyond the faces that the cell shares with the domain.
  Coordinates outside_pose(const PoseCell& poses) const {
    const PoseCell& domain = tree_[0].poses;
    Coordinates at = poses.center();
    if (landscape_.exit.crossing({at, at}).outside == 0.0) return at;
    for (int axis = 0; axis < turn_axis; ++axis) {
      const double beyond = poses.high[axis] - poses.low[axis];
      if (poses.low[axis] == domain.low[axis]) at[axis] = poses.low[axis] - beyond;
      if (poses.high[axis] == domain.high[axis]) at[axis] = poses.high[axis] + beyond;
    }
    return at;
  }

  // In the middle of the face of two cells; of two that meet at half a turn, of the first one.
  static Coordinates between(const PoseCell& a, const PoseCell& b) {
    const Coordinates low = a.low.cwiseMax(b.low), high = a.high.cwiseMin(b.high);
    return (low.array() <= high.array()).all() ? Coordinates(0.5 * (low + high)) : a.center();
  }

  static std::size_t index(int cell) { return static_cast<std::size_t>(cell); }

  const Landscape& landscape_;
  const FloodBudget& budget_;
  CellTree tree_;
  double least_width_;
  double lift_ = 0.0;  // by the object's thickness [J]
  std::priority_queue<Front> fronts_;
  std::vector<Arrival> arrivals_;  // by cell
  std::vector<int> neighbours_;
  double level_ = 0.0;
  int way_out_ = -1;
  int next_check_ = 0;  // of the way out as a whole, at so many cells
  int looked_ = 0;
};

}  // namespace

BarrierBound barrier_bound(const Subject& subject, const Region& captured, const FloodBudget& budget) {
  const ObjectSpace space(subject);
  const Landscape landscape{space, {subject, space}, {subject, space}, exit_energy(subject, captured, space)};
  BarrierBound bound = Flood(landscape, budget).run();
  bound.reason = landscape.exit.reason;
  return bound;
}

}  // namespace energymargin::bounds
