// Joints that follow others.

#include <Eigen/Cholesky>
#include <map>

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
  for (const std::vector<MimicConstraint>& mimics : bodies_.mimics()) join(mimics);
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
