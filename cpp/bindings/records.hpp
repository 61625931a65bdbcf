#pragma once
// Python classes by the description of a struct's fields (base/record.hpp).

#include <functional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "argument.hpp"
#include "base/record.hpp"

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

//! The argument of a function that sets a field.
template <typename Struct, typename Get>
using FieldArgument = Argument<Member<Struct, Get>>;
template <typename Struct, typename Get>
using FieldInput = typename FieldArgument<Struct, Get>::Input;

//! Sets each field to its argument.
template <typename Struct, typename... Get>
void assign_fields(Struct& object, const std::tuple<Field<Get>...>& fields, const FieldInput<Struct, Get>&... inputs) {
  std::apply(
      [&](const auto&... field) {
        ((std::invoke(field.get, object) = FieldArgument<Struct, Get>::of(field.name, inputs)), ...);
      },
      fields);
}

//! The keyword of a field, with the default of the struct.
template <typename Struct, typename Get>
py::arg_v field_keyword(const Field<Get>& field) {
  return py::arg(field.name) = python_value(std::invoke(field.get, Struct{}));
}

//! One line for each field.
template <typename... Get>
std::string fields_doc(const std::tuple<Field<Get>...>& fields) {
  std::string doc;
  const auto add = [&](const auto& field) {
    if (field.description) doc += (doc.empty() ? "" : "\n") + std::string(field.name) + ": " + field.description;
  };
  std::apply([&](const auto&... field) { (add(field), ...); }, fields);
  return doc;
}

//! A constructor with one argument for each field; `check` may throw.
template <typename Struct, typename Check, typename... Get>
void def_fields_constructor(py::class_<Struct>& type, const Check& check, const std::tuple<Field<Get>...>& fields) {
  const auto construct = [=](const FieldInput<Struct, Get>&... inputs) {
    Struct object;
    assign_fields(object, fields, inputs...);
    check(object);
    return object;
  };
  const std::string doc = fields_doc(fields);
  std::apply([&](const auto&... field) { type.def(py::init(construct), py::arg(field.name)..., doc.c_str()); }, fields);
}

}  // namespace energymargin::binding
