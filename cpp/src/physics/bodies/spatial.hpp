#pragma once
// Spatial vectors and inertias in the world's axes, about one common point (Featherstone, Rigid Body Dynamics
// Algorithms, 2008). As all are about the same point, those of several bodies simply add up.

#include <btBulletDynamicsCommon.h>

namespace energymargin {

inline btVector3 vector(const double* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

//! A motion: angular velocity, and velocity of what is at the common point. Or a force: moment about it, and force.
struct SpatialVector {
  btVector3 angular = btVector3(0, 0, 0);
  btVector3 linear = btVector3(0, 0, 0);

  SpatialVector operator+(const SpatialVector& other) const { return {angular + other.angular, linear + other.linear}; }
  SpatialVector operator*(double factor) const { return {angular * factor, linear * factor}; }
  SpatialVector& operator+=(const SpatialVector& other) { return *this = *this + other; }

  //! Power of a force on a motion.
  double dot(const SpatialVector& other) const { return angular.dot(other.angular) + linear.dot(other.linear); }

  //! Rate of a motion vector that moves with this motion.
  SpatialVector cross_motion(const SpatialVector& motion) const {
    return {angular.cross(motion.angular), angular.cross(motion.linear) + linear.cross(motion.angular)};
  }

  //! Rate of a force vector that moves with this motion.
  SpatialVector cross_force(const SpatialVector& force) const {
    return {angular.cross(force.angular) + linear.cross(force.linear), angular.cross(force.linear)};
  }
};

//! What makes a momentum of a motion.
struct SpatialInertia {
  double mass = 0.0;                                                   // [kg]
  btVector3 first_moment = btVector3(0, 0, 0);                         // mass * centre [kg m]
  btMatrix3x3 second_moment = btMatrix3x3(0, 0, 0, 0, 0, 0, 0, 0, 0);  // about the common point [kg m^2]

  SpatialInertia() = default;

  //! Of a body whose centre is at `arm` from the common point, with principal `moments` about `axes`.
  SpatialInertia(double mass_, const btVector3& moments, const btMatrix3x3& axes, const btVector3& arm)
      : mass(mass_), first_moment(mass_ * arm), second_moment(axes.scaled(moments).timesTranspose(axes)) {
    const btVector3& h = first_moment;
    const double square = h.dot(arm);
    second_moment += btMatrix3x3(square - h.x() * arm.x(), -h.x() * arm.y(), -h.x() * arm.z(),  //
                                 -h.y() * arm.x(), square - h.y() * arm.y(), -h.y() * arm.z(),  //
                                 -h.z() * arm.x(), -h.z() * arm.y(), square - h.z() * arm.z());
  }

  SpatialInertia& operator+=(const SpatialInertia& other) {
    mass += other.mass;
    first_moment += other.first_moment;
    second_moment += other.second_moment;
    return *this;
  }

  SpatialVector operator*(const SpatialVector& motion) const {
    return {second_moment * motion.angular + first_moment.cross(motion.linear),
            mass * motion.linear + motion.angular.cross(first_moment)};
  }
};

}  // namespace energymargin
