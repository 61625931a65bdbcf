#pragma once
// Python classes by the description of a struct's fields (base/record.hpp).

#include <functional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "given.hpp"

namespace energymargin::binding {

//! The class of a record's type, as ConvexHull of "convex_hull".
std::string class_name(const std::string& type);

//! A field's value as Python sees it.
template <typename Value>
auto python_value(const Value& value) {
  if constexpr (std::is_enum_v<Value>) {
    return std::string(word_of(value));
  } else if constexpr (std::is_same_v<Value, Quaternion>) {
    return Eigen::Vector4d(value.coeffs());
  } else if constexpr (std::is_same_v<Value, std::vector<Vector3>>) {
    return States(Eigen::Map<const States>(value.empty() ? nullptr : value[0].data(),
                                           static_cast<Eigen::Index>(value.size()), 3));
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
template <typename Get, typename Struct, typename... Options>
void def_field(py::class_<Struct, Options...>& type, const Field<Get>& field) {
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
template <typename Class, typename... Get>
void def_fields(Class& type, const std::tuple<Field<Get>...>& fields, const std::set<std::string>& renamed = {}) {
  const auto def = [&](const auto& field) {
    if (renamed.count(field.name) == 0) def_field(type, field);
  };
  std::apply([&](const auto&... field) { (def(field), ...); }, fields);
}

//! How Python calls a function that makes a struct of its fields.
struct Signature {
  std::size_t positional = 99;       //!< the arguments after so many go by name alone
  std::set<std::string> optional{};  //!< fields with a default, besides those that files may leave out
};

//! An argument, with a default if `value` is set. From the first by name on they all go by name alone.
struct FieldKeyword : py::arg {
  FieldKeyword(const char* field_name, py::object default_value, const char* text, bool is_first)
      : py::arg(field_name), value(std::move(default_value)), shown(text), first_by_name(is_first) {}
  py::object value;
  const char* shown;  // in the signature; null: as Python shows the value
  bool first_by_name;
};

template <typename Value>
py::object default_of(const Value& value) {
  if constexpr (std::is_same_v<Value, Vector3>) {
    return py::make_tuple(value.x(), value.y(), value.z());
  } else if constexpr (std::is_same_v<Value, std::string> || std::is_same_v<Value, Quaternion>) {
    return py::none();  // the empty one, or no turn
  } else {
    return py::cast(python_value(value));
  }
}

//! Whether None stands for a field's default.
template <typename Value, typename Get>
inline constexpr bool may_be_none = std::is_same_v<Value, Quaternion>;
template <typename Struct, typename Get, typename Value = Member<Struct, Get>>
using FieldInput = Given<std::conditional_t<may_be_none<Value, Get>, std::optional<Value>, Value>>;

//! One line for each field that has a description.
template <typename... Get>
std::string fields_doc(const std::tuple<Field<Get>...>& fields, const std::string& margin = "") {
  std::string doc;
  const auto add = [&](const auto& field) {
    if (field.description) doc += (doc.empty() ? "" : "\n") + margin + field.name + ": " + field.description;
  };
  std::apply([&](const auto&... field) { (add(field), ...); }, fields);
  return doc;
}

//! Calls `define(function, keywords...)` with a function of `Before` and the fields that calls `make(struct, before)`.
template <typename Result, typename Struct, typename... Before, typename Define, typename... Get>
void with_fields(const std::tuple<Field<Get>...>& fields, const Signature& signature, Result (*make)(Struct, Before...),
                 const Define& define) {
  const auto function = [=](Before... before, const FieldInput<Struct, Get>&... inputs) {
    Struct object = initial<Struct>();
    const auto set = [&](const auto& field, const auto& input) {
      auto& value = std::invoke(field.get, object);
      if constexpr (may_be_none<std::decay_t<decltype(value)>, std::decay_t<decltype(field.get)>>) {
        value = given(field.name, input).value_or(value);
      } else {
        value = given(field.name, input);
      }
    };
    std::apply([&](const auto&... field) { (set(field, inputs), ...); }, fields);
    return make(std::move(object), before...);
  };
  std::size_t position = 0;
  const auto defaults = initial<Struct>();
  const auto keyword = [&](const auto& field) {
    using Value = std::decay_t<decltype(std::invoke(field.get, defaults))>;
    const bool has_default = field.presence == Presence::optional || signature.optional.count(field.name) != 0;
    return FieldKeyword(field.name, has_default ? default_of(std::invoke(field.get, defaults)) : py::object(),
                        std::is_same_v<Value, ForceWeights> ? "ForceWeights()" : nullptr,
                        position++ == signature.positional);
  };
  const auto keywords = std::apply([&](const auto&... field) { return std::tuple{keyword(field)...}; }, fields);
  std::apply([&](const auto&... each) { define(function, each...); }, keywords);
}

//! Defines a function of `arguments` and the fields in a module or a class.
template <typename Scope, typename Fields, typename Make, typename... Arguments>
void def_function(Scope& scope, const char* name, const std::string& doc, const Fields& fields,
                  const Signature& signature, const Make& make, const Arguments&... arguments) {
  with_fields(fields, signature, make, [&](const auto& function, const auto&... keywords) {
    scope.def(name, function, arguments..., keywords..., doc.c_str());
  });
}

template <typename Struct>
Struct unchanged(Struct object) {
  return object;
}

//! A constructor with one argument for each field; `make` may throw.
template <typename Struct>
void def_fields_constructor(py::class_<Struct>& type, const Signature& signature, Struct (*make)(Struct)) {
  with_fields(record_of<Struct>.fields, signature, make, [&](const auto& function, const auto&... keywords) {
    type.def(py::init(function), keywords..., fields_doc(record_of<Struct>.fields).c_str());
  });
}

//! A class with a property and an argument of its constructor for each field.
template <typename Struct>
py::class_<Struct> bind_record(py::module_& module, const char* name, const char* doc,
                               const Signature& signature = {}) {
  py::class_<Struct> type(module, name, doc);
  def_fields_constructor(type, signature, &unchanged<Struct>);
  def_fields(type, record_of<Struct>.fields);
  return type;
}

}  // namespace energymargin::binding

namespace pybind11::detail {

template <>
struct process_attribute<energymargin::binding::FieldKeyword>
    : process_attribute_default<energymargin::binding::FieldKeyword> {
  static void init(const energymargin::binding::FieldKeyword& keyword, function_record* record) {
    if (keyword.first_by_name) process_attribute<kw_only>::init(kw_only(), record);
    if (keyword.value) {
      process_attribute<arg_v>::init(arg_v(keyword, keyword.value, keyword.shown), record);
    } else {
      process_attribute<arg>::init(keyword, record);
    }
  }
};

}  // namespace pybind11::detail
