#pragma once
// EST and RRT with pruning: planners of OMPL that keep, of a node, its row in the problem's tree.

#include <ompl/base/Planner.h>
#include <ompl/base/StateSampler.h>
#include <ompl/control/ControlSampler.h>
#include <ompl/control/PathControl.h>
#include <ompl/datastructures/NearestNeighborsGNAT.h>

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "energymargin/random.hpp"
#include "energymargin/search/ao.hpp"
#include "search/cost_space.hpp"
#include "search/ompl_random.hpp"

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

  //! The index at which the sum of the weights, of which there is one, reaches `share` (0..1) of the sum of all.
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
  int draw(Draws& rng) const {
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

//! It grows in rounds of edges from nodes that it has; a derived planner says from which. The problem outlives it.
class NodePlanner : public ompl::base::Planner, public Prunable {
 public:
  //! How many nodes a round extends, but no more than the tree has; 1 at first, as published.
  void set_nodes_per_round(int count) { nodes_per_round_ = count; }

  //! A solution is told as the state in which it ends: the path to it is in the problem's tree.
  ompl::base::PlannerStatus solve(const ompl::base::PlannerTerminationCondition& ptc) override {
    checkValidity();
    while (const ompl::base::State* start = pis_.nextStart()) add(node_of(start));
    if (empty()) return ompl::base::PlannerStatus::INVALID_START;
    int solution = -1;
    while (solution < 0 && !ptc) {
      for (const int node : problem_.extend(round())) {
        if (!problem_.allowed(node)) continue;
        add(node);
        if (solution < 0 && problem_.escaped(node)) solution = node;
      }
    }
    if (solution < 0) return ompl::base::PlannerStatus::TIMEOUT;
    const auto path = std::make_shared<ompl::control::PathControl>(si_);
    path->append(&described(solution));
    pdef_->addSolutionPath(path, false, 0.0, getName());
    return ompl::base::PlannerStatus::EXACT_SOLUTION;
  }

 protected:
  NodePlanner(BoundedProblem& problem, const char* name)
      : Planner(problem.space_information(), name),
        problem_(problem),
        sampler_(problem.space_information()->allocControlSampler()) {
    state_.objects = si_->getStateSpace()->as<CostSpace>()->starts();
    setProblemDefinition(problem.definition());
  }

  virtual bool empty() const = 0;
  virtual void add(int node) = 0;
  virtual EdgeFrom draw() = 0;

  //! An edge from a node, as the problem's controls are drawn.
  EdgeFrom draw_edge(int node) {
    const auto* controls = problem_.space_information()->getControlSpace()->as<WrenchSpace>();
    Eigen::VectorXd before(controls->getDimension()), values(controls->getDimension());
    before << problem_.edge(node).wrenches, 0.0;
    WrenchSpace::ControlType last, next;
    last.values = before.data();
    next.values = values.data();
    sampler_->sampleNext(&next, &last, &described(node));
    sampler_->sampleStepCount(1, 1);  // OMPL's planners draw that too, from the same stream
    return {node, controls->edge(&next)};
  }

  //! A node as OMPL sees it, until the next call.
  const CostSpace::StateType& described(int node) {
    problem_.describe(node, &state_);
    return state_;
  }

  BoundedProblem& problem_;

 private:
  std::vector<EdgeFrom> round() {
    // A first round of many edges from the root alone would make the tree shallow.
    const int nodes = problem_.nodes() + 1;
    const int count = std::min({nodes_per_round_, nodes, std::max(problem_.rollouts_left(), 1)});
    std::vector<EdgeFrom> round;
    for (int i = 0; i < count; ++i) round.push_back(draw());
    return round;
  }

  ompl::control::ControlSamplerPtr sampler_;
  int nodes_per_round_ = 1;
  CostSpace::StateType state_;
};

//! A planner as OMPL's EST: nodes in thinly settled regions, which a grid counts, are extended first. All nodes of a
//! round are drawn from the tree as it is before the round.
class Est : public NodePlanner {
 public:
  Est(BoundedProblem& problem, std::uint64_t seed)
      : NodePlanner(problem, "EST"), projection_(si_->getStateSpace()->getDefaultProjection()) {
    rng_.setLocalSeed(static_cast<std::uint_fast32_t>(seed));
  }

  void prune(double bound) override {
    const std::vector<int> nodes = grid_.nodes();
    grid_ = {};
    for (const int node : nodes) {
      if (problem_.worth_keeping(node, bound)) add(node);
    }
  }

 private:
  bool empty() const override { return grid_.empty(); }

  void add(int node) override {
    Eigen::VectorXi cell(projection_->getDimension());
    projection_->computeCoordinates(&described(node), cell);
    grid_.add(node, cell);
  }

  EdgeFrom draw() override { return draw_edge(grid_.draw(rng_)); }

  Draws rng_;
  ompl::base::ProjectionEvaluatorPtr projection_;
  DensityGrid grid_;
};

//! A planner as OMPL's RRT, without its bias to the goal: the node nearest to a random state, cost and, with a horizon,
//! time is extended. Samples depend on the seed of the problem.
class Rrt : public NodePlanner {
 public:
  explicit Rrt(BoundedProblem& problem) : NodePlanner(problem, "RRT"), state_sampler_(si_->allocStateSampler()) {
    sample_.objects = si_->getStateSpace()->as<CostSpace>()->starts();
    nodes_.setDistanceFunction([this](int a, int b) { return si_->distance(state(a), state(b)); });
  }

  //! A node stays if all stay that it grew from.
  void prune(double bound) override {
    const auto stays = [&](int node) {
      while (node >= 0 && problem_.worth_keeping(node, bound)) node = problem_.parent(node);
      return node < 0;
    };
    std::vector<int> nodes;
    nodes_.list(nodes);
    nodes_.clear();
    for (const int node : nodes) {
      if (stays(node)) {
        nodes_.add(node);
      } else {
        states_[static_cast<std::size_t>(node)].reset();
      }
    }
  }

 private:
  static constexpr int sampled = -1;         // as a node
  static constexpr double rounding = 1e-12;  // of distances

  bool empty() const override { return nodes_.size() == 0; }

  void add(int node) override {
    states_.resize(std::max(states_.size(), static_cast<std::size_t>(node) + 1));
    auto& state = states_[static_cast<std::size_t>(node)] = std::make_unique<CostSpace::StateType>();
    static_cast<CostSpace::Values&>(*state) = described(node);
    nodes_.add(node);
  }

  EdgeFrom draw() override {
    state_sampler_->sampleUniform(&sample_);
    return draw_edge(nearest_to_sample());
  }

  // The first one of equally near nodes. Which of them OMPL's structure finds depends on pivots that it draws from a
  // global seed, and rollouts that leave the object where it is make many such ties.
  int nearest_to_sample() const {
    const int any = nodes_.nearest(sampled);
    std::vector<int> ties;
    nodes_.nearestR(sampled, si_->distance(&sample_, state(any)) * (1.0 + rounding) + rounding, ties);
    ties.push_back(any);
    return *std::min_element(ties.begin(), ties.end());
  }

  const ompl::base::State* state(int node) const {
    return node == sampled ? &sample_ : states_[static_cast<std::size_t>(node)].get();
  }

  ompl::base::StateSamplerPtr state_sampler_;
  CostSpace::StateType sample_;
  std::vector<std::unique_ptr<CostSpace::StateType>> states_;  // of the tree's nodes that are among `nodes_`
  ompl::NearestNeighborsGNAT<int> nodes_;                      // -1 would be the sample
};

}  // namespace energymargin::search
