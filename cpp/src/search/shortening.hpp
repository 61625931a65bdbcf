#pragma once
// Makes an escape cheaper by small changes to its edges, each replayed in the world.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "base/portable.hpp"
#include "energymargin/search/ao.hpp"
#include "search/edge_changes.hpp"
#include "search/ompl_random.hpp"
#include "search/polish.hpp"

namespace energymargin::search {

//! Local search around the best escape, by rollouts that are nodes of the tree. Where changes no longer help, it
//! descends anew from an escape that it guesses, and then goes on with the best: small steps rarely change the form of
//! an escape, as the side on which it leaves. With a clock there is one descent, and an edge keeps its time when one
//! before it changes: between them lies a wait, an edge without a wrench of any length.
class Shortening {
 public:
  //! `bounded` is the search in which `problem`'s escapes are replayed.
  Shortening(const Problem& problem, BoundedProblem& bounded, std::uint64_t seed)
      : problem_(bounded),
        largest_(largest_edge(problem)),
        horizon_(bounded.horizon()),
        rng_(static_cast<std::uint_fast32_t>(seed)),
        changes_(largest_, horizon_, rng_),
        polish_(largest_, rng_),
        slow_motion_(problem, largest_) {}

  //! The changes refer to this very object.
  Shortening(const Shortening&) = delete;
  Shortening& operator=(const Shortening&) = delete;

  //! From now on it tries so many changes at once, all of the escape as it is before them; 1 at first.
  void set_attempts_per_round(int count) { attempts_per_round_ = count; }

  //! Goes on from the best escape, which ends in `node`; 0: there is none.
  void start(int node) {
    best_ = node;
    descend_from(node);
  }

  //! Waits from the root on, without a clock: an object that moves may leave by itself. True if it did.
  bool wait() {
    std::vector<Attempt> round{{0, with_rests({}, rests_of_a_wait)}};
    return !horizon_ && replay(round) && is_best();
  }

  //! Tries changes of an escape, or pushes from the root without one yet. True if that finds the cheapest escape of
  //! all.
  bool attempt() {
    // One descent from the best escape, the next from a new one.
    if (!horizon_ && !descends()) descend_from(path_.back() == best_ ? 0 : best_);
    std::vector<Attempt> round;
    for (int i = 0; i < attempts_per_round_; ++i) round.push_back(path_.size() < 2 ? guess() : change());
    return replay(round) && is_best();
  }

  //! The node in which the best escape ends.
  int end() const { return best_; }

 private:
  // Without a clock.
  static constexpr int rests_of_a_wait = 10;     // longest edges
  static constexpr double waiting_share = 0.02;  // of the attempts
  static constexpr double polish_ratio = 1.5;    // polishes by other attempts
  static constexpr int first_others = 100;       // before the first polish: the escape gets its form
  static constexpr double slow_share = 0.1;      // of the other attempts
  static constexpr int most_passages = 6;        // pushes of an escape that is slowed down
  static constexpr double slowest = 3.0;         // times slower, drawn evenly in its logarithm, as the surplus is
  static constexpr double least_surplus = 1e-3, most_surplus = 0.3;
  static constexpr double long_rest_share = 0.03;  // of the changes end with a wait
  static constexpr double pushing_share = 0.75;    // of the changes are to an edge that has a wrench
  static constexpr int longest_guess = 3;          // longest edges
  static constexpr double even_share = 0.5;        // of the guesses are not at the bounds

  // A descent ends once so many rollouts have not brought its cost down to this share of what it was.
  static constexpr int patience = 100;
  static constexpr double much_lower = 0.98;

  // With a clock.
  static constexpr double whole_share = 0.5;   // of the changes begin at the root, and guesses last up to the horizon
  static constexpr double single_share = 0.5;  // of the guesses push one object alone

  struct Attempt {
    int node;  // from which its edges lead, and then to which they have led
    TimedEdges edges;
    std::optional<Polish::Trial> trial{};  // of the polish
    bool waits = false;                    // from the root on
    Outcome outcome = Outcome::infeasible;
    bool over = false;
  };

  void descend_from(int node) {
    go_on_from(node);
    mark_ = bound_;
    marked_ = rollouts_;
    polishes_ = others_ = 0;
  }

  void go_on_from(int node) {
    path_ = problem_.path_to(node);
    bound_ = node > 0 ? problem_.cost(node) : std::numeric_limits<double>::infinity();
  }

  bool descends() {
    if (bound_ < much_lower * mark_) {
      mark_ = bound_;
      marked_ = rollouts_;
    }
    return rollouts_ - marked_ <= patience;
  }

  bool is_best() {
    if (best_ > 0 && bound_ >= problem_.cost(best_)) return false;
    best_ = path_.back();
    problem_.lower_bound(bound_);
    return true;
  }

  // With a clock it is at the bounds of its axes, from some time on, for some time or up to the horizon: where time is
  // short few draws of a planner's lead out. Without one it may be weaker, or a wait.
  Attempt guess() {
    if (!horizon_ && rng_.uniform01() < waiting_share) return wait_on();
    TimedEdge push = draw_push();
    const auto axes = static_cast<int>(push.wrenches.size());
    const int object = rng_.uniform01() < single_share ? rng_.uniformInt(0, axes / wrench_axes - 1) : -1;
    const bool even = !horizon_ && rng_.uniform01() < even_share;
    for (int axis = 0; axis < axes; ++axis) {
      if (object >= 0 && axis / wrench_axes != object) continue;
      const double share = even ? rng_.uniformReal(-1.0, 1.0) : rng_.uniformInt(-1, 1);
      push.wrenches[axis] = share * largest_.wrenches[axis];
    }
    TimedEdges edges;
    prepend(edges, push, largest_.steps);
    return {0, horizon_ ? with_waits(edges, 0) : with_rests(edges, draw_rests())};
  }

  // A polish goes on to its end. Then other changes have as many attempts, and may give the escape another form.
  Attempt change() {
    if (horizon_) return change_edges();
    if (rng_.uniform01() < waiting_share) return wait_on();
    const bool goes_on = polish_.goes_on() && polished_ == path_.back();
    const bool polishes = goes_on || polishes_ <= polish_ratio * (others_ - first_others);
    ++(polishes ? polishes_ : others_);
    if (polishes) return polish();
    return rng_.uniform01() < slow_share ? slow_down() : change_edges();
  }

  Attempt change_edges() {
    const std::size_t node = draw_node();
    const EdgeChanges::Change& drawn = changes_.draw();
    const bool all = drawn.concerns_all || (horizon_ && rng_.uniform01() < whole_share);
    const std::size_t from = all ? 0 : node;
    TimedEdges edges = edges_from(from);
    if (edges.empty()) return {path_[from], {}};
    drawn.apply(edges);
    if (horizon_) return {path_[from], with_waits(edges, problem_.time(path_[from]))};
    return {path_[from], with_rests(edges, draw_rests())};
  }

  Attempt polish() {
    if (!polish_.goes_on() || polished_ != path_.back()) polish_.start(edges_from(0));
    polished_ = path_.back();
    Polish::Trial trial = polish_.draw();
    return {0, with_rests(trial.edges, 1), std::move(trial)};
  }

  // As the world sees it, or as one who moves along with what moves at the root.
  Attempt slow_down() {
    const std::vector<Passage> escape = passages(rng_.uniformInt(1, most_passages));
    const State root = problem_.state(0);
    const bool along = rng_.uniform01() < 0.5;
    const double slowdown = portable::exp(rng_.uniformReal(0.0, portable::log(slowest)));
    const double surplus = portable::exp(rng_.uniformReal(portable::log(least_surplus), portable::log(most_surplus)));
    const State frame = along ? root : State::Zero(root.size());
    return {0, with_rests(slow_motion_(escape, frame, slowdown, surplus), draw_rests())};
  }

  // The escape's edges, cut until there are so many pushes. Where an edge is cut, a rollout tells the state.
  std::vector<Passage> passages(int pushes) {
    std::vector<int> nodes = path_;
    std::vector<Edge> edges;
    for (std::size_t i = 1; i < path_.size(); ++i) edges.push_back(problem_.edge(path_[i]));
    while (!problem_.spent()) {
      std::vector<std::size_t> cut;  // those that can be
      for (std::size_t i = 0; i < edges.size(); ++i) {
        if (!edges[i].wrenches.isZero(0.0) && edges[i].steps > 1) cut.push_back(i);
      }
      if (cut.empty() || static_cast<int>(cut.size()) >= pushes) break;
      const std::size_t i = cut[static_cast<std::size_t>(rng_.uniformInt(0, static_cast<int>(cut.size()) - 1))];
      Edge first = edges[i];
      first.steps = rng_.uniformInt(1, first.steps - 1);
      const int middle = problem_.extend(nodes[i], first, bound_);
      if (middle < 0) break;
      edges[i].steps -= first.steps;
      edges.insert(edges.begin() + static_cast<std::ptrdiff_t>(i), first);
      nodes.insert(nodes.begin() + static_cast<std::ptrdiff_t>(i) + 1, middle);
    }
    std::vector<Passage> passages;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      passages.push_back({edges[i], problem_.state(nodes[i]), problem_.state(nodes[i + 1])});
    }
    return passages;
  }

  // From the root, or where the last wait from it ended, or anywhere on the path. The first rest is of any length.
  Attempt wait_on() {
    const bool from_root = path_.size() < 2 || rng_.uniform01() < 0.5;
    const bool anew = rng_.uniform01() < 0.5;
    const int node = from_root ? (anew ? 0 : waited_) : path_[draw_node()];
    TimedEdges edges{rest(0, rng_.uniformInt(1, largest_.steps))};
    return {node, with_rests(edges, rests_of_a_wait), {}, from_root};
  }

  // Of the path, but its end: where the first edge that changes starts or, with a clock, the wait before it.
  std::size_t draw_node() {
    const auto last = static_cast<int>(path_.size()) - 2;
    auto node = static_cast<std::size_t>(rng_.uniformInt(0, last));
    const auto rests = [&](std::size_t i) { return problem_.edge(path_[i]).wrenches.isZero(0.0); };
    if (horizon_) {
      while (node > 0 && rests(node)) --node;
    } else if (rng_.uniform01() < pushing_share) {
      while (node > 0 && rests(node + 1)) --node;
    }
    return node;
  }

  // With a clock from some time on, for some time or up to the horizon.
  TimedEdge draw_push() {
    if (!horizon_) return rest(0, rng_.uniformInt(1, longest_guess * largest_.steps));
    const bool whole = rng_.uniform01() < whole_share;
    const int start = whole ? 0 : rng_.uniformInt(0, *horizon_ - 1);
    return rest(start, whole ? *horizon_ : rng_.uniformInt(1, *horizon_ - start));
  }

  int draw_rests() { return rng_.uniform01() < long_rest_share ? rests_of_a_wait : 1; }

  TimedEdge rest(int start, int steps) const {
    return {{Eigen::VectorXd::Zero(largest_.wrenches.size()), steps}, start};
  }

  // With a clock without waits: they are what lies between two edges.
  TimedEdges edges_from(std::size_t node) const {
    TimedEdges edges;
    for (std::size_t i = node + 1; i < path_.size(); ++i) {
      TimedEdge edge{problem_.edge(path_[i]), problem_.time(path_[i - 1])};
      if (!horizon_ || !edge.wrenches.isZero(0.0)) edges.push_back(std::move(edge));
    }
    return edges;
  }

  // Each at its time, as far as the one before it and the horizon leave it; `time` is where they begin.
  TimedEdges with_waits(const TimedEdges& edges, int time) const {
    TimedEdges schedule;
    for (TimedEdge edge : edges) {
      const int end = std::min(edge.start + edge.steps, *horizon_);
      edge.start = std::max(edge.start, time);
      edge.steps = end - edge.start;
      if (edge.steps < 1 || edge.wrenches.isZero(0.0)) continue;
      if (edge.start > time) schedule.push_back(rest(time, edge.start - time));
      schedule.push_back(edge);
      time = end;
    }
    if (time < *horizon_) schedule.push_back(rest(time, *horizon_ - time));
    return schedule;
  }

  // An escape that falls short ends without a wrench: what it lacks may come of itself, and costs nothing.
  TimedEdges with_rests(TimedEdges edges, int count) const {
    edges.insert(edges.end(), static_cast<std::size_t>(count), rest(0, largest_.steps));
    return edges;
  }

  // Makes all rollouts of some attempts: the next edge of each of them at once. Whether one is a cheaper escape.
  bool replay(std::vector<Attempt>& round) {
    std::vector<Attempt*> going;
    std::vector<EdgeFrom> edges;
    for (std::size_t next = 0; !problem_.spent(); ++next) {
      going.clear();
      edges.clear();
      for (Attempt& each : round) {
        const bool goes_on = !each.over && next < each.edges.size();
        if (!goes_on || static_cast<int>(edges.size()) == problem_.rollouts_left()) continue;
        going.push_back(&each);
        edges.push_back({each.node, each.edges[next]});
      }
      if (going.empty()) break;
      const std::vector<int> nodes = problem_.extend(edges, bound_);
      rollouts_ += static_cast<int>(edges.size());
      for (std::size_t i = 0; i < going.size(); ++i) {
        lead(*going[i], i < nodes.size() ? nodes[i] : -1, edges[i].edge.wrenches.isZero(0.0));
      }
    }
    bool better = false;
    for (Attempt& each : round) better = conclude(each) || better;
    return better;
  }

  // To the node of its next edge; -1 if the limit was reached first.
  void lead(Attempt& attempt, int node, bool rests) {
    attempt.node = node;
    if (!problem_.allowed(node, bound_)) {
      attempt.outcome = Outcome::worse;
    } else if (problem_.escaped(node)) {
      attempt.outcome = Outcome::better;
    } else if (horizon_ || !rests || !problem_.at_rest(node)) {
      return;
    }
    attempt.over = true;
  }

  // Of a round each counts beside those before it. Whether the escape goes on from this one.
  bool conclude(Attempt& attempt) {
    Outcome& outcome = attempt.outcome;
    if (outcome == Outcome::better && problem_.cost(attempt.node) >= bound_) outcome = Outcome::worse;
    if (outcome == Outcome::better) go_on_from(attempt.node);
    if (attempt.trial) polish_.tell(*attempt.trial, outcome);
    if (attempt.trial && outcome == Outcome::better) polished_ = attempt.node;
    if (attempt.waits && outcome == Outcome::infeasible) waited_ = attempt.node;
    return outcome == Outcome::better;
  }

  BoundedProblem& problem_;
  int attempts_per_round_ = 1;
  Edge largest_;
  std::optional<int> horizon_;  // steps
  Draws rng_;
  EdgeChanges changes_;
  Polish polish_;
  SlowMotion slow_motion_;
  int best_ = 0;  // the node in which the best escape ends

  // The descent.
  std::vector<int> path_{0};                                // nodes from the root to the end of its escape
  double bound_ = std::numeric_limits<double>::infinity();  // the escape's cost
  double mark_ = bound_;                                    // a cost, and how many rollouts there were when it was it
  int marked_ = 0;
  int polishes_ = 0;   // attempts that were one
  int others_ = 0;     // and those that were none
  int polished_ = -1;  // the node in which the escape ends that the polish goes on from

  int rollouts_ = 0;
  int waited_ = 0;  // the node in which the last wait from the root ends
};

}  // namespace energymargin::search
