#pragma once
// What there is: bodies, their friction, gravity and the settings of the simulation. Plain values, validated.

#include <optional>
#include <string>
#include <vector>

#include "energymargin/shape.hpp"
#include "energymargin/types.hpp"

namespace energymargin {

//! What a body is in the manipulation.
enum class Role {
  none,      ///< environment
  object,    ///< the body that disturbances act on
  effector,  ///< the robot
};

//! One rigid body.
struct Body {
  std::string name;  //!< unique in its scene
  Shape shape = Box{};
  double mass = 0.0;      //!< [kg]; 0: fixed
  BodyState state{};      //!< where it is when nothing else is said
  double friction = 0.5;  //!< a contact's coefficient is the product of its two bodies'
  Role role = Role::none;
  Vector3 linear_factor = Vector3::Ones();   //!< 1: free along the axis, 0: locked
  Vector3 angular_factor = Vector3::Ones();  //!< 1: free about the axis, 0: locked

  bool fixed() const { return mass == 0.0; }
};

//! How the physics is stepped.
struct Stepping {
  double step = 1.0 / 240.0;       //!< length of one step [s]
  int iterations = 50;             //!< solver iterations a step, at most
  double tolerance = 1e-7;         //!< the solver stops early below this squared residual
  std::optional<double> margin{};  //!< collision margin [m]; unset: a twentieth of each shape's smallest half extent
};

//! Bodies under gravity. Every function that takes bad input throws std::invalid_argument.
class Scene {
 public:
  explicit Scene(const Vector3& gravity = Vector3(0.0, 0.0, -9.81), const Stepping& stepping = {});

  //! Adds a body and returns its index; validates shape, mass, state, friction and factors.
  std::size_t add_body(Body body);

  const Vector3& gravity() const { return gravity_; }  //!< [m/s^2]
  const Stepping& stepping() const { return stepping_; }
  const std::vector<Body>& bodies() const { return bodies_; }

  //! Index of a body by name; the error lists the names that there are.
  std::size_t index(const std::string& name) const;
  const Body& body(const std::string& name) const { return bodies_[index(name)]; }

  //! Index of the only body of a role, or none.
  std::optional<std::size_t> with_role(Role role) const;

 private:
  Vector3 gravity_;
  Stepping stepping_;
  std::vector<Body> bodies_;
};

}  // namespace energymargin
