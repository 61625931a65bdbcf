#pragma once
// Python classes by the description of a struct's fields (base/record.hpp).

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "base/record.hpp"
#include "convert.hpp"

namespace energymargin::binding {

//! (n, 3).
py::array_t<double> array_of_points(const std::vector<Vector3>& points);

//! A field's value as Python sees it.
template <typename Value>
auto python_value(const Value& value) {
  if constexpr (std::is_enum_v<Value>) {
    return std::string(word_of(value));
  } else if constexpr (std::is_same_v<Value, Quaternion>) {
    return Eigen::Vector4d(value.coeffs());
  } else if constexpr (std::is_same_v<Value, std::vector<Vector3>>) {
    return array_of_points(value);
  } else {
    return value;
  }
}

//! What a property is: the field's description and, of an array, its shape.
template <typename Value>
std::string property_doc(const char* description) {
  if constexpr (std::is_same_v<Value, Quaternion>) return description ? description : "Unit quaternion x, y, z, w.";
  std::string text = description ? description : "";
  if (!text.empty() && text.back() == ']') text += ".";
  const char* shape = "";
  if constexpr (std::is_same_v<Value, Vector3>) shape = "Shape (3,).";
  if constexpr (std::is_same_v<Value, std::vector<Vector3>>) shape = "Shape (n, 3).";
  return text + (text.empty() || *shape == '\0' ? "" : " ") + shape;
}

//! A read-only property for a field.
template <typename Struct, typename Get>
void def_field(py::class_<Struct>& type, const Field<Get>& field) {
  using Value = Member<Struct, Get>;
  const std::string doc = property_doc<Value>(field.description);
  constexpr bool as_it_is = std::is_same_v<decltype(python_value(std::declval<const Value&>())), Value>;
  if constexpr (std::is_member_object_pointer_v<Get> && as_it_is) {
    type.def_readonly(field.name, field.get, doc.c_str());
  } else {
    const auto value = [get = field.get](const Struct& object) { return python_value(std::invoke(get, object)); };
    type.def_property_readonly(field.name, value, doc.c_str());
  }
}

//! A read-only property for each field, but for those with another name in Python.
template <typename Struct, typename... Get>
void def_fields(py::class_<Struct>& type, const std::tuple<Field<Get>...>& fields,
                const std::set<std::string>& renamed = {}) {
  const auto def = [&](const auto& field) {
    if (renamed.count(field.name) == 0) def_field(type, field);
  };
  std::apply([&](const auto&... field) { (def(field), ...); }, fields);
}

template <typename Value>
struct ArgumentOf {
  using type = Value;
};
template <>
struct ArgumentOf<double> {
  using type = Number;
};
template <>
struct ArgumentOf<Vector3> {
  using type = ArrayLike;
};
template <>
struct ArgumentOf<std::vector<Vector3>> {
  using type = ArrayLike;
};

//! The argument of a function that sets a field.
template <typename Struct, typename Get>
using Argument = typename ArgumentOf<Member<Struct, Get>>::type;

inline void assign(const std::string& name, const Number& argument, double& value) { value = real(name, argument); }
inline void assign(const std::string& name, const ArrayLike& argument, Vector3& value) {
  value = vector3(name, argument);
}
inline void assign(const std::string& name, const ArrayLike& argument, std::vector<Vector3>& value) {
  value = points(name, argument);
}
template <typename Value>
void assign(const std::string&, const Value& argument, Value& value) {
  value = argument;
}

//! Sets each field to its argument.
template <typename Struct, typename... Get>
void assign_fields(Struct& object, const std::tuple<Field<Get>...>& fields, const Argument<Struct, Get>&... arguments) {
  std::apply([&](const auto&... field) { (assign(field.name, arguments, std::invoke(field.get, object)), ...); },
             fields);
}

//! The keyword of a field, with the default of the struct.
template <typename Struct, typename Get>
py::arg_v keyword(const Field<Get>& field) {
  return py::arg(field.name) = python_value(std::invoke(field.get, Struct{}));
}

//! A constructor with one argument for each field; `check` may throw.
template <typename Struct, typename Check, typename... Get>
void def_constructor(py::class_<Struct>& type, const Check& check, const std::tuple<Field<Get>...>& fields) {
  const auto construct = [=](const Argument<Struct, Get>&... arguments) {
    Struct object;
    assign_fields(object, fields, arguments...);
    check(object);
    return object;
  };
  std::apply([&](const auto&... field) { type.def(py::init(construct), py::arg(field.name)...); }, fields);
}

}  // namespace energymargin::binding
