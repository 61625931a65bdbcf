#pragma once
// Inertia along principal axes.

#include <Eigen/Eigenvalues>

#include "energymargin/shape.hpp"

namespace energymargin {

//! Mass properties from the inertia about the centre, along the axes of the shape's frame [kg m^2].
inline MassProperties principal(double volume, const Vector3& center, const Eigen::Matrix3d& inertia) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia);
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0.0) axes.col(0) = -axes.col(0);
  return {volume, center, solver.eigenvalues(), Quaternion(axes).normalized()};
}

}  // namespace energymargin
