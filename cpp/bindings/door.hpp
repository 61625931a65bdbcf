#pragma once
// The Python door: array-likes come in with their argument's name, so that an error can name it.

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <string>
#include <vector>

#include "energymargin/problem.hpp"
#include "energymargin/types.hpp"

namespace py = pybind11;

namespace energymargin::door {

//! Anything that numpy.asarray takes.
struct ArrayLike {
  py::object value;
};

//! (rows, columns) numbers; -1 accepts any size. Throws std::invalid_argument that names the argument, the shape and
//! what was expected.
States matrix(const std::string& name, const ArrayLike& array, Eigen::Index rows, Eigen::Index columns);

Eigen::VectorXd vector(const std::string& name, const ArrayLike& array, Eigen::Index size);
Vector2 vector2(const std::string& name, const ArrayLike& array);
Vector3 vector3(const std::string& name, const ArrayLike& array);
Quaternion quaternion(const std::string& name, const ArrayLike& array);
std::vector<Vector3> points(const std::string& name, const ArrayLike& array);
Wrench wrench(const std::string& name, const ArrayLike& array);

//! True for a single state, false for a table of states; throws for anything else.
bool is_single(const std::string& name, const ArrayLike& array);

Role role(const std::string& name);
std::string role_name(Role role);
Effector effector(const std::string& name);
std::string effector_name(Effector effector);

//! Orientation from a quaternion or from a yaw angle about z, at most one of them.
Quaternion orientation(const std::string& prefix, const std::optional<ArrayLike>& quaternion_xyzw,
                       std::optional<double> yaw, const Quaternion& otherwise);

void bind_scene(py::module_& module);
void bind_world(py::module_& module);
void bind_regions(py::module_& module);
void bind_problem(py::module_& module);
void bind_scores(py::module_& module);

}  // namespace energymargin::door

namespace pybind11::detail {

template <>
struct type_caster<energymargin::door::ArrayLike> {
  PYBIND11_TYPE_CASTER(energymargin::door::ArrayLike, const_name("numpy.typing.ArrayLike"));

  bool load(handle source, bool) {
    if (!source || source.is_none()) return false;
    value.value = reinterpret_borrow<object>(source);
    return true;
  }

  static handle cast(const energymargin::door::ArrayLike& array, return_value_policy, handle) {
    return object(array.value).release();
  }
};

}  // namespace pybind11::detail
