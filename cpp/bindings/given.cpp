#include "given.hpp"

#include <limits>
#include <sstream>
#include <stdexcept>

#include "base/check.hpp"
#include "base/portable.hpp"

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

Numbers numbers(const std::string& name, const py::handle& value) {
  // numpy decides on the type first: a cast would read numbers from strings, and drop imaginary parts.
  const py::array array_of_any_type = array_of(value);
  if (!array_of_any_type || std::string("iuf").find(array_of_any_type.dtype().kind()) == std::string::npos) {
    reject(name, short_repr(value), "an array of real numbers");
  }
  return Numbers::ensure(array_of_any_type);
}

// The error for a float such as 1e3 says how to write it: as 1000.
std::string expected_whole(const py::handle& value, const std::string& range) {
  const bool whole = py::isinstance<py::float_>(value) && value.attr("is_integer")().cast<bool>();
  return "a whole number" +
         (whole ? ", as " + short_repr(py::int_(py::reinterpret_borrow<py::object>(value))) : " " + range);
}

// True and False count nothing.
py::object index_of(const py::handle& value) {
  return py::reinterpret_steal<py::object>(PyBool_Check(value.ptr()) ? nullptr : PyNumber_Index(value.ptr()));
}

void warn_once(const std::vector<Warning>& warnings, const std::string& fingerprint) {
  py::list pairs;
  for (const Warning& warning : warnings) pairs.append(py::make_tuple(warning.about, warning.text));
  py::module_::import("energymargin.base.plausibility").attr("warn")(pairs, fingerprint);
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

void refuse(const std::string& name, const py::handle& value, const std::string& expected) {
  throw py::type_error(name + " is " + short_repr(value) + ", expected " + expected);
}

double convert(Type<double>, const std::string& name, const py::handle& value) {
  const double number = py::isinstance<py::str>(value) ? 0.0 : PyFloat_AsDouble(value.ptr());
  if (PyErr_Occurred() == nullptr && !py::isinstance<py::str>(value)) return number;
  PyErr_Clear();
  reject(name, short_repr(value), "a real number");
}

int convert(Type<int>, const std::string& name, const py::handle& value) {
  return count(name, {py::reinterpret_borrow<py::object>(value)}, 1);
}

std::uint64_t convert(Type<std::uint64_t>, const std::string& name, const py::handle& value) {
  const py::object index = index_of(value);
  const std::uint64_t number = index ? PyLong_AsUnsignedLongLong(index.ptr()) : 0;
  if (index && PyErr_Occurred() == nullptr) return number;
  PyErr_Clear();
  reject(name, short_repr(value), expected_whole(value, "from 0 to 2^64 - 1"));
}

Eigen::VectorXd convert(Type<Eigen::VectorXd>, const std::string& name, const py::handle& value) {
  return vector(name, value, -1);
}

Vector2 convert(Type<Vector2>, const std::string& name, const py::handle& value) { return vector(name, value, 2); }
Vector3 convert(Type<Vector3>, const std::string& name, const py::handle& value) { return vector(name, value, 3); }

Quaternion convert(Type<Quaternion>, const std::string& name, const py::handle& value) {
  if (PyFloat_Check(value.ptr()) || PyLong_Check(value.ptr())) {
    reject(name, short_repr(value), "a unit quaternion (x, y, z, w); a body also takes yaw=, an angle about z");
  }
  return Quaternion(Eigen::Vector4d(vector(name, value, 4)));
}

std::vector<Vector3> convert(Type<std::vector<Vector3>>, const std::string& name, const py::handle& value) {
  const States rows = matrix(name, {py::reinterpret_borrow<py::object>(value)}, -1, 3);
  std::vector<Vector3> points;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) points.emplace_back(rows.row(i).transpose());
  return points;
}

regions::PlanarMotion convert(Type<regions::PlanarMotion>, const std::string& name, const py::handle& value) {
  const auto motion = cast<py::dict>(name, value, "a dict of position, velocity and yaw_rate");
  for (const char* key : {"position", "velocity", "yaw_rate"}) {
    if (!motion.contains(key)) throw std::invalid_argument(name + " has no '" + key + "'");
  }
  return {vector(name + ": position", motion["position"], 2), vector(name + ": velocity", motion["velocity"], 2),
          vector(name + ": yaw_rate", py::make_tuple(motion["yaw_rate"]), 1)[0]};
}

int count(const std::string& name, const Given<int>& number, int least) {
  const py::object index = index_of(number.value);
  int overflow = 0;
  const long long value = index ? PyLong_AsLongLongAndOverflow(index.ptr(), &overflow) : 0;
  PyErr_Clear();
  constexpr int most = std::numeric_limits<int>::max();
  if (index && overflow == 0 && value >= least && value <= most) return static_cast<int>(value);
  const std::string smallest = std::to_string(least);
  const bool large = overflow > 0 || value > most;
  reject(name, short_repr(number.value),
         expected_whole(number.value,
                        large ? "from " + smallest + " to " + std::to_string(most) : "of at least " + smallest));
}

States matrix(const std::string& name, const GivenArray& array, Eigen::Index rows, Eigen::Index columns) {
  const Numbers in = numbers(name, array.value);
  if (in.ndim() != 2 || (rows >= 0 && in.shape(0) != rows) || (columns >= 0 && in.shape(1) != columns)) {
    reject(name, "an array of shape " + shape_text(in),
           "an array of shape (" + size_text(rows) + ", " + size_text(columns) + ")");
  }
  return Eigen::Map<const States>(in.data(), in.shape(0), in.shape(1));
}

Eigen::VectorXd vector(const std::string& name, const py::handle& array, Eigen::Index size) {
  const Numbers in = numbers(name, array);
  if (in.ndim() != 1 || (size >= 0 && in.shape(0) != size)) {
    reject(name, "an array of shape " + shape_text(in), "an array of shape (" + size_text(size) + ",)");
  }
  return Eigen::Map<const Eigen::VectorXd>(in.data(), in.shape(0));
}

Disturbance wrenches(const std::string& name, const GivenArray& array, std::size_t objects) {
  const auto count = static_cast<Eigen::Index>(objects);
  const States rows = count > 1 ? matrix(name, array, count, 6) : States(vector(name, array.value, 6).transpose());
  Disturbance disturbance;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    disturbance.push_back({rows.row(i).head<3>().transpose(), rows.row(i).tail<3>().transpose()});
  }
  return disturbance;
}

Plan plan_of_rows(const std::string& wrenches_name, const Rows& wrenches, const Rows& targets) {
  Plan plan;
  for (const auto& [body, rows] : wrenches) {
    plan.wrenches.push_back({body, matrix(wrenches_name + "['" + body + "']", rows, -1, 6)});
  }
  for (const auto& [joint, rows] : targets) {
    plan.targets.push_back({joint, vector("targets['" + joint + "']", rows.value, -1)});
  }
  return plan;
}

bool is_single(const std::string& name, const GivenArray& array) {
  const Numbers in = numbers(name, array.value);
  if (in.ndim() != 1 && in.ndim() != 2) {
    reject(name, "an array of shape " + shape_text(in), "one state (n,) or several (N, n)");
  }
  return in.ndim() == 1;
}

Quaternion orientation(const std::string& prefix, const std::optional<Quaternion>& quaternion,
                       std::optional<double> yaw, const Quaternion& otherwise) {
  if (quaternion && yaw) reject(prefix + "orientation", "given together with yaw", "one of the two");
  if (!yaw) return quaternion.value_or(otherwise);
  if (!std::isfinite(*yaw)) reject(prefix + "yaw", std::to_string(*yaw), "a finite angle in rad");
  warn(implausible_angle(prefix + "yaw", *yaw));
  return portable::turn(*yaw, Vector3::UnitZ());
}

void warn(const std::vector<Warning>& warnings, const Scene& scene) {
  if (!warnings.empty()) warn_once(warnings, fingerprint(scene));
}

void warn(const std::optional<Warning>& warning) {
  if (warning) warn_once({*warning}, warning->text);
}

Sentences sentences(const std::vector<Warning>& warnings) {
  py::list texts;
  for (const Warning& warning : warnings) texts.append(warning.text);
  return py::tuple(texts);
}

}  // namespace energymargin::binding
