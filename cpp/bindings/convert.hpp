#pragma once
// Conversion of Python's values. An error names the argument, its value and what was expected.

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/typing.h>

#include <string>
#include <vector>

#include "energymargin/problem.hpp"
#include "energymargin/types.hpp"

namespace py = pybind11;

namespace energymargin::binding {

//! Whatever numpy.asarray accepts.
struct ArrayLike {
  py::object value;
};

//! Whatever has __index__.
struct WholeNumber {
  py::object value;
};

//! Whatever has __float__ or __index__, but text.
struct Number {
  py::object value;
};

//! Whatever is given for a Value: `given` casts it, so that an error names the argument.
template <typename Value>
struct Given {
  py::object value;
};

//! A function of states, shape (N, n), that returns N truth values.
struct StatesPredicate {
  py::function value;
};

//! Bodies by name, each a dict of position, orientation, yaw, velocity and angular_velocity; joints under "joints".
struct BodyDicts {
  py::dict value;
};

//! A value as Python shows it, cut to 60 characters.
std::string short_repr(const py::handle& value);

//! A value as an array, null if numpy cannot convert it. KeyboardInterrupt and its like pass through.
py::array array_of(const py::handle& value);

//! The text of a str. Throws std::invalid_argument in the name of `what` unless UTF-8 can encode it.
std::string word(const std::string& what, const py::handle& value);

//! Throws std::invalid_argument that names the argument unless it is a real number.
double real(const std::string& name, const Number& number);
std::optional<double> real(const std::string& name, const std::optional<Number>& number);

//! Throws std::invalid_argument that names the argument unless it is a whole number from 0 to 2^64 - 1.
std::uint64_t seed(const std::string& name, const WholeNumber& number);

//! The same for a whole number from `least` to 2^31 - 1.
int count(const std::string& name, const WholeNumber& number, int least = 1);

//! (rows, columns) numbers; -1 accepts any size. Throws std::invalid_argument that names the argument, the shape and
//! what was expected.
States matrix(const std::string& name, const ArrayLike& array, Eigen::Index rows, Eigen::Index columns);

Eigen::VectorXd vector(const std::string& name, const ArrayLike& array, Eigen::Index size);
Vector2 vector2(const std::string& name, const ArrayLike& array);
Vector3 vector3(const std::string& name, const ArrayLike& array);
Quaternion quaternion(const std::string& name, const ArrayLike& array);
std::vector<Vector3> points(const std::string& name, const ArrayLike& array);

//! (6,) for one object, (objects, 6) for several.
Disturbance wrenches(const std::string& name, const ArrayLike& array, std::size_t objects);

//! True for a single state, false for a table of states; throws for anything else.
bool is_single(const std::string& name, const ArrayLike& array);

//! Orientation from a quaternion or from a yaw angle about z, at most one of them.
Quaternion orientation(const std::string& prefix, const std::optional<ArrayLike>& quaternion_xyzw,
                       std::optional<double> yaw, const Quaternion& otherwise);

}  // namespace energymargin::binding

namespace pybind11::detail {

// Python objects that pass through as they are, under a name that a type checker understands.
template <typename Wrapper, typename Object>
struct named_object_caster {
  bool load(handle source, bool) {
    if (!source || !isinstance<Object>(source)) return false;
    value.value = reinterpret_borrow<Object>(source);
    return true;
  }
  static handle cast(const Wrapper& wrapper, return_value_policy, handle) { return Object(wrapper.value).release(); }

  template <typename>
  using cast_op_type = Wrapper&;
  operator Wrapper&() { return value; }

  Wrapper value;
};

template <>
struct type_caster<energymargin::binding::ArrayLike> : named_object_caster<energymargin::binding::ArrayLike, object> {
  static constexpr auto name = const_name("numpy.typing.ArrayLike");
};
template <>
struct type_caster<energymargin::binding::WholeNumber>
    : named_object_caster<energymargin::binding::WholeNumber, object> {
  static constexpr auto name = const_name("int");
};
template <>
struct type_caster<energymargin::binding::Number> : named_object_caster<energymargin::binding::Number, object> {
  static constexpr auto name = const_name("float");
};
template <typename Value>
struct type_caster<energymargin::binding::Given<Value>>
    : named_object_caster<energymargin::binding::Given<Value>, object> {
  static constexpr auto name = make_caster<Value>::name;
};
template <>
struct type_caster<energymargin::binding::StatesPredicate>
    : named_object_caster<energymargin::binding::StatesPredicate, function> {
  static constexpr auto name =
      const_name("collections.abc.Callable[[numpy.typing.NDArray[numpy.float64]], numpy.typing.ArrayLike]");
};
template <>
struct type_caster<energymargin::binding::BodyDicts> : named_object_caster<energymargin::binding::BodyDicts, dict> {
  static constexpr auto name = const_name("dict[str, dict[str, typing.Any]]");
};

}  // namespace pybind11::detail
