#pragma once
// What the files of this folder share: arguments from Python and their errors, how objects show, warnings.

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/typing.h>

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/record.hpp"
#include "base/words.hpp"
#include "energymargin/metrics/interval.hpp"
#include "energymargin/plausibility.hpp"
#include "energymargin/problem.hpp"
#include "gil.hpp"

namespace py = pybind11;

namespace energymargin::binding {

// What each file adds to the module.
using Bind = void(pybind11::module_& module);
Bind bind_shapes, bind_bodies, bind_scene, bind_plan, bind_world, bind_regions, bind_problem, bind_capture, bind_effort,
    bind_baselines, bind_batch, bind_probability;

void bind_additions(pybind11::class_<Scene>& scene);  // add_body, add_joint and the like

//! What Python gives for a Value; `given` makes that of it. A type checker sees what it may be.
template <typename Value>
struct Given {
  py::object value;
};

//! An array of any shape.
using GivenArray = Given<States>;

//! A value as Python shows it, cut to 60 characters.
std::string short_repr(const py::handle& value);

//! A value as an array, null if numpy cannot convert it. KeyboardInterrupt and its like pass through.
py::array array_of(const py::handle& value);

//! The text of a str. Throws std::invalid_argument in the name of `what` unless UTF-8 can encode it.
std::string word(const std::string& what, const py::handle& value);

[[noreturn]] void refuse(const std::string& name, const py::handle& value, const std::string& expected);

// Numbers have __float__ or __index__, and are no text; whole numbers have __index__; arrays are what numpy.asarray
// accepts. They throw std::invalid_argument, everything else TypeError.
double convert(Type<double>, const std::string& name, const py::handle& value);
int convert(Type<int>, const std::string& name, const py::handle& value);  // from 1 to 2^31 - 1
std::uint64_t convert(Type<std::uint64_t>, const std::string& name, const py::handle& value);
Vector2 convert(Type<Vector2>, const std::string& name, const py::handle& value);
Vector3 convert(Type<Vector3>, const std::string& name, const py::handle& value);
Quaternion convert(Type<Quaternion>, const std::string& name, const py::handle& value);  // x, y, z, w
Eigen::VectorXd convert(Type<Eigen::VectorXd>, const std::string& name, const py::handle& value);
std::vector<Vector3> convert(Type<std::vector<Vector3>>, const std::string& name, const py::handle& value);
regions::PlanarMotion convert(Type<regions::PlanarMotion>, const std::string& name, const py::handle& value);

//! A whole number from `least` to 2^31 - 1.
int count(const std::string& name, const Given<int>& number, int least);

//! (rows, columns) numbers; -1 accepts any size.
States matrix(const std::string& name, const GivenArray& array, Eigen::Index rows, Eigen::Index columns);
Eigen::VectorXd vector(const std::string& name, const py::handle& array, Eigen::Index size);

//! (6,) for one object, (objects, 6) for several.
Disturbance wrenches(const std::string& name, const GivenArray& array, std::size_t objects);

using Rows = std::map<std::string, GivenArray>;

//! An interval as Python has it.
using Ends = std::pair<double, double>;
inline Ends ends(const Interval& interval) { return {interval.low, interval.high}; }

//! A plan's wrenches by body, (K, 6), and targets by joint, (K,). Errors call the wrenches `wrenches_name`.
Plan plan_of_rows(const std::string& wrenches_name, const Rows& wrenches, const Rows& targets);

//! True for a single state, false for a table of states; throws for anything else.
bool is_single(const std::string& name, const GivenArray& array);

//! Orientation from a quaternion or from a yaw angle about z, at most one of them.
Quaternion orientation(const std::string& prefix, const std::optional<Quaternion>& quaternion,
                       std::optional<double> yaw, const Quaternion& otherwise);

// What a value is, in words: "a Scene", "True or False".
template <typename Value>
std::string in_words(Type<Value>) {
  if constexpr (std::is_same_v<Value, bool>) {
    return "True or False";
  } else if constexpr (std::is_same_v<Value, std::string>) {
    return "a str";
  } else if constexpr (std::is_base_of_v<py::function, Value>) {
    return "a function";
  } else {
    const auto name = py::type::of<Value>().attr("__name__").template cast<std::string>();
    return (std::string("AEIOU").find(name[0]) == std::string::npos ? "a " : "an ") + name;
  }
}
template <typename Value>
std::string in_words(Type<std::shared_ptr<Value>>) {
  return in_words(Type<Value>{});
}
template <typename Value>
std::string in_words(Type<std::vector<Value>>) {
  return "a list, each item " + in_words(Type<Value>{});
}
template <typename... Values>
std::string in_words(Type<std::variant<Values...>>) {
  return alternatives({in_words(Type<Values>{})...}, "");
}

template <typename Value>
Value cast(const std::string& name, const py::handle& value, const std::string& expected) {
  try {
    if constexpr (std::is_base_of_v<py::object, Value>) {
      if (py::isinstance<Value>(value)) return py::reinterpret_borrow<Value>(value);
    } else {
      return value.cast<Value>();
    }
  } catch (const py::builtin_exception&) {  // cast_error, and reference_cast_error of None
  }
  refuse(name, value, expected);
}

template <typename Value>
Value convert(Type<Value>, const std::string& name, const py::handle& value) {
  if constexpr (std::is_enum_v<Value>) {
    return value_of<Value>(name, cast<std::string>(name, value, "a str"));
  } else {
    return cast<Value>(name, value, in_words(Type<Value>{}));
  }
}
template <typename Value>
std::optional<Value> convert(Type<std::optional<Value>>, const std::string& name, const py::handle& value) {
  if (value.is_none()) return std::nullopt;
  return convert(Type<Value>{}, name, value);
}

template <typename Value>
Value given(const std::string& name, const Given<Value>& input) {
  return convert(Type<Value>{}, name, input.value);
}

//! The object of a class that was given, itself and no copy.
template <typename Value>
const Value& given_object(const std::string& name, const Given<Value>& input) {
  if (!py::isinstance<Value>(input.value)) refuse(name, input.value, in_words(Type<Value>{}));
  return input.value.template cast<const Value&>();
}

//! Keyword arguments of a call.
using KeywordArguments = py::KWArgs<py::object>;

//! Reads them: each `(name, value)` sets the value, unless nothing is given for it.
class Keywords {
 public:
  explicit Keywords(const KeywordArguments& arguments) : unread_(arguments.attr("copy")()) {}

  template <typename Value>
  const Keywords& operator()(const char* name, Value& value) const {
    if (unread_.contains(name)) value = convert(Type<Value>{}, name, unread_.attr("pop")(name));
    return *this;
  }

  //! Throws TypeError if a keyword is left that nobody reads.
  void end() const {
    if (!unread_.empty()) throw py::type_error("unexpected keyword arguments " + short_repr(py::list(unread_)));
  }

 private:
  py::dict unread_;
};

//! A function of a problem and of keywords, which energymargin/scores.py explains to users, and checks.
template <typename Result>
void def_metric(py::module_& module, const char* name, Result (*metric)(const Problem&, const Keywords&)) {
  const auto call = [metric](const Given<Problem>& problem, const KeywordArguments& keywords) {
    return metric(given_object("problem", problem), Keywords(keywords));
  };
  module.def(name, call, py::arg("problem"));
}

//! As Type(name=value, ...), each value as Python shows it.
template <typename Fields = std::initializer_list<std::pair<const char*, py::object>>>
std::string repr_of_fields(const std::string& type, const Fields& fields) {
  std::string text;
  for (const auto& [name, value] : fields) {
    text += (text.empty() ? "" : ", ") + std::string(name) + "=" + py::repr(value).template cast<std::string>();
  }
  return type + "(" + text + ")";
}

//! __repr__ as title(attribute=value, ...).
template <typename Class>
void def_repr(Class& type, const char* title, const std::vector<const char*>& attributes) {
  type.def("__repr__", [title, attributes](const py::object& self) {
    std::vector<std::pair<const char*, py::object>> fields;
    for (const char* name : attributes) fields.emplace_back(name, self.attr(name));
    return repr_of_fields(title, fields);
  });
}

//! Issues each warning, once for all states of a scene. Throws if a filter of Python makes the warning an error.
void warn(const std::vector<Warning>& warnings, const Scene& scene);

//! Issues a warning that is of no scene, if there is one.
void warn(const std::optional<Warning>& warning);

using Sentences = py::typing::Tuple<py::str, py::ellipsis>;
Sentences sentences(const std::vector<Warning>& warnings);

template <typename Result>
void def_step_counts(py::class_<Result>& type, const char* steps_doc) {
  type.def_readonly("steps", &Result::steps, steps_doc)
      .def_readonly("unconverged", &Result::unconverged, "Of these, steps whose contact solver did not converge.")
      .def_readonly("lost_time", &Result::lost_time,
                    "Time in which nothing moved, as bodies would have passed through each other [s].");
}

//! What a result made of rollouts says about its steps, and its warnings, of which `example` is one.
template <typename Result>
void def_quality(py::class_<Result>& type, const std::string& example) {
  def_step_counts(type, "Simulation steps of its rollouts.");
  type.def_property_readonly(
      "warnings", [](const Result& result) { return sentences(result.warnings); },
      ("Sentences that speak against the result: " + example +
       "more than 1 % of the steps did not converge, or of the time is lost.")
          .c_str());
}

}  // namespace energymargin::binding

namespace pybind11::detail {

// What a type checker reads for a Value that is given.
template <typename Value>
constexpr auto name_of_given(energymargin::Type<Value>) {
  if constexpr (std::is_same_v<Value, double>) {
    return const_name("float");
  } else if constexpr (std::is_integral_v<Value> && !std::is_same_v<Value, bool>) {
    return const_name("int");
  } else if constexpr (std::is_enum_v<Value>) {
    return const_name("str");
  } else if constexpr (std::is_same_v<Value, energymargin::regions::PlanarMotion>) {
    return const_name("dict[str, numpy.typing.ArrayLike]");
  } else if constexpr (std::is_base_of_v<Eigen::EigenBase<Value>, Value> ||
                       std::is_same_v<Value, energymargin::Quaternion> ||
                       std::is_same_v<Value, std::vector<energymargin::Vector3>>) {
    return const_name("numpy.typing.ArrayLike");
  } else {
    return make_caster<Value>::name;
  }
}
template <typename Value>
constexpr auto name_of_given(energymargin::Type<std::optional<Value>>) {
  return make_caster<std::optional<energymargin::binding::Given<Value>>>::name;
}

template <typename Value>
struct type_caster<energymargin::binding::Given<Value>> {
  static constexpr auto name = name_of_given(energymargin::Type<Value>{});
  bool load(handle source, bool) {
    if (source) value.value = reinterpret_borrow<object>(source);
    return static_cast<bool>(source);
  }
  static handle cast(const energymargin::binding::Given<Value>& given, return_value_policy, handle) {
    return object(given.value).release();
  }
  template <typename>
  using cast_op_type = energymargin::binding::Given<Value>&;
  operator energymargin::binding::Given<Value>&() { return value; }
  energymargin::binding::Given<Value> value;
};

}  // namespace pybind11::detail
