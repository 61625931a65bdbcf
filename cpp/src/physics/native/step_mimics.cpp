// Joints that follow others, and what they and loops do to the velocities at the end of a substep.

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>

#include "physics/native/step_equations.hpp"

namespace energymargin {

void StepEquations::add_mimic(const MimicConstraint& mimic, double duration) {
  LimitedRow& row = add_sum_row(mimic, 1.0);
  row.work = &audit.work.joints;
  row.softness = coupling_softness * solver_.inverse_mass(row, 0);
  share_error(-(sum_of(mimic).position - mimic.constant), row.target, row.recovery);
  follow_way(row, duration);
}

// As bodies coast, loops of free bodies and joints that follow others leave each other by half of what the next
// impulses are to turn round. A state has none of that: the least change of momentum that brings them back, as in
// RATTLE (Andersen 1983).
void StepEquations::join_velocities(double duration) {
  const auto& loops = bodies_.loops();
  if (std::any_of(loops.begin(), loops.end(), [this](const LoopConstraint& loop) { return ties_free(loop); })) {
    join_loops(duration);
  }
  for (const std::vector<MimicConstraint>& mimics : bodies_.mimics()) join(mimics);
}

bool StepEquations::ties_free(const LoopConstraint& loop) const {
  return !bodies_.link(loop.a) && !bodies_.link(loop.b);
}

// Solves (2) for no time, where the bodies are now, with the rows of loops alone. What moves as prescribed aside, no
// energy is gained.
void StepEquations::join_loops(double duration) {
  solver_.clear();
  loop_rows_.clear();
  for (FreeBody& body : bodies_.free()) {
    body.axes.resize(body.unlocked);
    add_free(body, 0.0);
  }
  for (const LoopConstraint& loop : bodies_.loops()) {
    if (ties_free(loop)) add_loop(loop, 0.0);
  }
  solver_.solve(scene_.stepping().most_iterations(), scene_.stepping().residual());
  for (const LimitedRow& row : solver_.limited()) {
    const double before = solver_.speed(row, 0, solver_.all_free());
    audit.work.joints += 0.5 * row.impulse * (before + solver_.speed(row, 0, solver_.all_velocities()));
  }
  for (FreeBody& body : bodies_.free()) {
    const btVector3 before = body.velocity.linear;
    for (std::size_t row = 0; row < body.unlocked; ++row) {
      body.velocity[body.axes[row]] = solver_.velocities(body.mover)[row];
    }
    if (body.kinematic) continue;  // the way of the substep was that of the velocities before
    const btVector3 weight = body.acceleration / body.inverse_mass;
    audit.work.integration += 0.5 * duration * weight.dot(body.velocity.linear - before);
  }
}

// Mimics of some trees, which share these with no others.
void StepEquations::join(const std::vector<MimicConstraint>& mimics) {
  std::map<std::size_t, std::vector<std::vector<double>>> answers;  // of each tree to each mimic
  for (std::size_t i = 0; i < mimics.size(); ++i) {
    for_each_velocity(mimics[i], [&](std::size_t tree, std::size_t k, double coefficient) {
      std::vector<std::vector<double>>& of_tree = answers[tree];
      of_tree.resize(mimics.size(), std::vector<double>(this->tree(tree).count(), 0.0));
      of_tree[i][k] += coefficient;
    });
  }
  for (auto& [index, of_tree] : answers) {
    tree(index).find_response();
    for (std::vector<double>& answer : of_tree) tree(index).respond(answer);
  }
  const auto count = static_cast<Eigen::Index>(mimics.size());
  Eigen::MatrixXd delassus = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd apart(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const MimicConstraint& mimic = mimics[static_cast<std::size_t>(j)];
    apart[j] = sum_of(mimic).velocity;
    for_each_velocity(mimic, [&](std::size_t tree, std::size_t k, double coefficient) {
      for (Eigen::Index i = 0; i < count; ++i) {
        delassus(j, i) += coefficient * answers[tree][static_cast<std::size_t>(i)][k];
      }
    });
  }
  const Eigen::VectorXd impulses = delassus.ldlt().solve(apart);
  audit.work.joints -= 0.5 * impulses.dot(apart);
  for (const auto& [index, of_tree] : answers) {
    std::vector<double>& velocities = tree(index).velocities();
    for (std::size_t i = 0; i < of_tree.size(); ++i) {
      for (std::size_t k = 0; k < velocities.size(); ++k) {
        velocities[k] -= impulses[static_cast<Eigen::Index>(i)] * of_tree[i][k];
      }
    }
  }
}

}  // namespace energymargin
