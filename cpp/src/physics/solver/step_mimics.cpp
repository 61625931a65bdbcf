// Joints that follow others.

#include <Eigen/Cholesky>

#include "physics/solver/step_equations.hpp"

namespace energymargin {

void StepEquations::add_mimic(const MimicConstraint& mimic, double duration) {
  LimitedRow& row = add_sum_row(mimic, 1.0);
  row.work = &audit.work.joints;
  row.softness = coupling_softness * solver_.inverse_mass(row, 0);
  share_error(-(sum_of(mimic).position - mimic.constant), row.target, row.recovery);
  follow_way(row, duration);
}

// As trees coast, joints that follow others leave them by half of what the next impulses are to turn round. A state has
// none of that: the least change of momentum that brings them back, as in RATTLE (Andersen 1983).
void StepEquations::join_mimics() {
  const std::vector<MimicConstraint>& mimics = bodies_.mimics();
  if (mimics.empty()) return;
  for (const auto& tree : bodies_.trees()) tree->find_response();
  const auto count = static_cast<Eigen::Index>(mimics.size());
  std::vector<std::vector<std::vector<double>>> answers;  // of each tree to each mimic
  Eigen::MatrixXd delassus(count, count);
  Eigen::VectorXd apart(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const MimicConstraint& mimic = mimics[static_cast<std::size_t>(i)];
    apart[i] = sum_of(mimic).velocity;
    answers.push_back(answers_to(mimic));
    for (Eigen::Index j = 0; j < count; ++j) {
      delassus(j, i) = 0.0;
      for_each_velocity(mimics[static_cast<std::size_t>(j)], [&](std::size_t tree, std::size_t k, double coefficient) {
        delassus(j, i) += coefficient * answers.back()[tree][k];
      });
    }
  }
  const Eigen::VectorXd impulses = delassus.ldlt().solve(apart);
  audit.work.joints -= 0.5 * impulses.dot(apart);
  for (std::size_t i = 0; i < answers.size(); ++i) {
    for (std::size_t t = 0; t < trees_.size(); ++t) {
      const std::vector<double>& answer = answers[i][t];
      for (std::size_t k = 0; k < answer.size(); ++k) {
        tree(t).velocities()[k] -= impulses[static_cast<Eigen::Index>(i)] * answer[k];
      }
    }
  }
}

// By how much a unit impulse along a sum of joints changes the velocities of each tree.
std::vector<std::vector<double>> StepEquations::answers_to(const JointSum& sum) const {
  std::vector<std::vector<double>> answers;
  for (const auto& tree : bodies_.trees()) answers.emplace_back(tree->count(), 0.0);
  for_each_velocity(sum, [&](std::size_t tree, std::size_t k, double coefficient) { answers[tree][k] += coefficient; });
  for (std::size_t t = 0; t < answers.size(); ++t) tree(t).respond(answers[t]);
  return answers;
}

}  // namespace energymargin
