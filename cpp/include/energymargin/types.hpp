#pragma once
// The vectors that every interface speaks: SI units, true scale, quaternions as x, y, z, w.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

// Flags such as -mavx2 would align and free vectors otherwise than the library does.
static_assert(EIGEN_MAX_STATIC_ALIGN_BYTES == 16 && EIGEN_MAX_ALIGN_BYTES <= 16 && EIGEN_MALLOC_ALREADY_ALIGNED,
              "energymargin needs -DEIGEN_MAX_ALIGN_BYTES=16 -DEIGEN_MAX_STATIC_ALIGN_BYTES=16 "
              "-DEIGEN_MALLOC_ALREADY_ALIGNED=1, which CMake's target energymargin::energymargin brings");

namespace energymargin {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using Quaternion = Eigen::Quaterniond;

//! One state z of object and robot, eq. 7; StateLayout says which number is what.
using State = Eigen::VectorXd;

//! N states, one a row.
using States = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

//! N wrenches, one a row: force [N], torque [N m]. With k objects a row has theirs one after the other, 6 k numbers.
using Wrenches = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

//! A disturbance u = (f, tau) of a body: at its centre of mass, in the world's axes.
struct Wrench {
  Vector3 force = Vector3::Zero();   //!< [N]
  Vector3 torque = Vector3::Zero();  //!< [N m]
};

//! A wrench for each object of a scene, in the scene's order.
using Disturbance = std::vector<Wrench>;

inline constexpr int wrench_axes = 6;  //!< of one object: three of its force and three of its torque

//! What acts on the k objects for a while: force [N] and torque [N m] on each, shape (6 k,).
struct Push {
  Eigen::VectorXd wrenches;
  int steps = 1;
};

//! Where a body is and how it moves, in the world's axes.
struct BodyState {
  Vector3 position = Vector3::Zero();               //!< of the body's frame [m]
  Quaternion orientation = Quaternion::Identity();  //!< unit quaternion
  Vector3 velocity = Vector3::Zero();               //!< of the frame's origin [m/s]
  Vector3 angular_velocity = Vector3::Zero();       //!< [rad/s]
};

//! A frame in another one.
struct Pose {
  Vector3 position = Vector3::Zero();               //!< of its origin [m]
  Quaternion orientation = Quaternion::Identity();  //!< unit quaternion
};

//! Where a joint is and how fast it moves: [rad] and [rad/s] about its axis, or [m] and [m/s] along it.
struct JointState {
  double position = 0.0;
  double velocity = 0.0;
};

}  // namespace energymargin
