#include "convert.hpp"

#include <limits>
#include <sstream>
#include <stdexcept>

#include "base/check.hpp"
#include "warnings.hpp"

namespace energymargin::binding {
namespace {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

// Any str as UTF-8; other characters, such as lone surrogates, are escaped.
std::string escaped(const py::handle& text) {
  return py::bytes(text.attr("encode")("utf-8", "backslashreplace")).cast<std::string>();
}

std::string shape_text(const Numbers& numbers) {
  std::ostringstream out;
  out << "(";
  for (py::ssize_t i = 0; i < numbers.ndim(); ++i) out << (i == 0 ? "" : ", ") << numbers.shape(i);
  out << (numbers.ndim() == 1 ? ",)" : ")");
  return out.str();
}

std::string size_text(Eigen::Index size) { return size < 0 ? "N" : std::to_string(size); }

Numbers numbers(const std::string& name, const ArrayLike& array) {
  // numpy decides on the type first: a cast would read numbers from strings, and drop imaginary parts.
  const py::array array_of_any_type = array_of(array.value);
  if (!array_of_any_type || std::string("iuf").find(array_of_any_type.dtype().kind()) == std::string::npos) {
    reject(name, short_repr(array.value), "an array of real numbers");
  }
  return Numbers::ensure(array_of_any_type);
}

// The error for a float such as 1e3 says how to write it: as 1000.
std::string expected_whole(const WholeNumber& number, const std::string& range) {
  const bool whole = py::isinstance<py::float_>(number.value) && number.value.attr("is_integer")().cast<bool>();
  return "a whole number" + (whole ? ", as " + short_repr(py::int_(number.value)) : " " + range);
}

}  // namespace

std::string short_repr(const py::handle& value) {
  const py::str text = py::repr(value);
  if (py::len(text) <= 60) return escaped(text);
  return escaped(text[py::slice(0, 57, 1)]) + "...";
}

py::array array_of(const py::handle& value) {
  try {
    return py::array(py::reinterpret_borrow<py::object>(value));
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_Exception)) throw;
    return py::reinterpret_steal<py::array>(py::handle());
  }
}

std::string word(const std::string& what, const py::handle& value) {
  if (!py::isinstance<py::str>(value)) reject(what, short_repr(value), "a str");
  const char* const text = PyUnicode_AsUTF8(value.ptr());
  if (text != nullptr) return value.cast<std::string>();
  PyErr_Clear();
  reject(what, short_repr(value), "a str that UTF-8 knows");
}

double real(const std::string& name, const Number& number) {
  const double value = py::isinstance<py::str>(number.value) ? 0.0 : PyFloat_AsDouble(number.value.ptr());
  if (PyErr_Occurred() == nullptr && !py::isinstance<py::str>(number.value)) return value;
  PyErr_Clear();
  reject(name, short_repr(number.value), "a real number");
}

std::optional<double> real(const std::string& name, const std::optional<Number>& number) {
  if (!number) return std::nullopt;
  return real(name, *number);
}

std::uint64_t seed(const std::string& name, const WholeNumber& number) {
  const auto index = py::reinterpret_steal<py::object>(PyNumber_Index(number.value.ptr()));
  const std::uint64_t value = index ? PyLong_AsUnsignedLongLong(index.ptr()) : 0;
  if (PyErr_Occurred() == nullptr) return value;
  PyErr_Clear();
  reject(name, short_repr(number.value), expected_whole(number, "from 0 to 2^64 - 1"));
}

int count(const std::string& name, const WholeNumber& number, int least) {
  const auto index = py::reinterpret_steal<py::object>(PyNumber_Index(number.value.ptr()));
  const long value = index ? PyLong_AsLong(index.ptr()) : 0;
  const bool fits = PyErr_Occurred() == nullptr && value >= least && value <= std::numeric_limits<int>::max();
  PyErr_Clear();
  if (!fits) reject(name, short_repr(number.value), expected_whole(number, "of at least " + std::to_string(least)));
  return static_cast<int>(value);
}

States matrix(const std::string& name, const ArrayLike& array, Eigen::Index rows, Eigen::Index columns) {
  const Numbers in = numbers(name, array);
  if (in.ndim() != 2 || (rows >= 0 && in.shape(0) != rows) || (columns >= 0 && in.shape(1) != columns)) {
    reject(name, "an array of shape " + shape_text(in),
           "an array of shape (" + size_text(rows) + ", " + size_text(columns) + ")");
  }
  return Eigen::Map<const States>(in.data(), in.shape(0), in.shape(1));
}

Eigen::VectorXd vector(const std::string& name, const ArrayLike& array, Eigen::Index size) {
  const Numbers in = numbers(name, array);
  if (in.ndim() != 1 || (size >= 0 && in.shape(0) != size)) {
    reject(name, "an array of shape " + shape_text(in), "an array of shape (" + size_text(size) + ",)");
  }
  return Eigen::Map<const Eigen::VectorXd>(in.data(), in.shape(0));
}

Vector2 vector2(const std::string& name, const ArrayLike& array) { return vector(name, array, 2); }
Vector3 vector3(const std::string& name, const ArrayLike& array) { return vector(name, array, 3); }

Quaternion quaternion(const std::string& name, const ArrayLike& array) {
  const Eigen::Vector4d xyzw = vector(name, array, 4);
  return Quaternion(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
}

std::vector<Vector3> points(const std::string& name, const ArrayLike& array) {
  const States rows = matrix(name, array, -1, 3);
  std::vector<Vector3> points;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) points.emplace_back(rows.row(i).transpose());
  return points;
}

Disturbance wrenches(const std::string& name, const ArrayLike& array, std::size_t objects) {
  const auto count = static_cast<Eigen::Index>(objects);
  const States rows = count > 1 ? matrix(name, array, count, 6) : States(vector(name, array, 6).transpose());
  Disturbance disturbance;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    disturbance.push_back({rows.row(i).head<3>().transpose(), rows.row(i).tail<3>().transpose()});
  }
  return disturbance;
}

bool is_single(const std::string& name, const ArrayLike& array) {
  const Numbers in = numbers(name, array);
  if (in.ndim() != 1 && in.ndim() != 2) {
    reject(name, "an array of shape " + shape_text(in), "one state (n,) or several (N, n)");
  }
  return in.ndim() == 1;
}

Quaternion orientation(const std::string& prefix, const std::optional<ArrayLike>& quaternion_xyzw,
                       std::optional<double> yaw, const Quaternion& otherwise) {
  if (quaternion_xyzw && yaw) reject(prefix + "orientation", "given together with yaw", "one of the two");
  if (quaternion_xyzw) return quaternion(prefix + "orientation", *quaternion_xyzw);
  if (!yaw) return otherwise;
  if (!std::isfinite(*yaw)) reject(prefix + "yaw", std::to_string(*yaw), "a finite angle in rad");
  warn_of_angle(prefix + "yaw", *yaw);
  return Quaternion(Eigen::AngleAxisd(*yaw, Vector3::UnitZ()));
}

}  // namespace energymargin::binding
