#pragma once
// Structs as records: one description of their fields, from which come their validation, the reader and the writer of
// problem files, the files' schema, and the Python classes.

#include <functional>
#include <optional>
#include <tuple>
#include <type_traits>
#include <variant>

#include "base/check.hpp"

namespace energymargin {

//! Which values a field may have. Unset: what the C++ type says.
enum class Form {
  any,
  positive,
  not_negative,
  positive_list,
  points,
  direction,
  bounds,
  factors,
  moments,
  lower_limit,   ///< "-inf" stands for a number
  upper_limit,   ///< "inf" stands for a number
  largest_size,  ///< the same
  sizes,         ///< the same
  turn,
  half_turn,
  body,   ///< the name of a body of the scene
  frame,  ///< the same
  regions,
  region,
};

using forms = Form;  //!< as fields name them

inline constexpr bool may_be_infinite(Form form) { return form >= Form::lower_limit && form <= Form::sizes; }

//! Whether a file has a field.
enum class Presence {
  required,
  added,     ///< written always; files of older versions lack it
  optional,  ///< written unless it has its default: of numbers, texts, enums and std::optional
};

//! One field of a struct. `get` is a pointer to a member, or a function from an object to a reference to the member.
template <typename Get>
struct Field {
  constexpr Field(const char* field_name, Get access, const char* text, Form values = Form::any,
                  Presence in_files = Presence::required)
      : name(field_name), get(access), description(text), form(values), presence(in_files) {}
  constexpr Field(const char* field_name, Get access, const char* text, Presence in_files)
      : Field(field_name, access, text, Form::any, in_files) {}

  const char* name;
  Get get;
  const char* description;  //!< null: that of the form
  Form form;
  Presence presence;
};

//! A type as a value.
template <typename T>
struct Type {
  using type = T;
};

//! What a struct is, by its name in the schema, and its fields in the order of files.
template <typename... Get>
struct Description {
  static constexpr bool is_alternative = false;

  constexpr Description(const char* struct_name, const char* text, Field<Get>... struct_fields)
      : name(struct_name), description(text), fields(struct_fields...) {}
  constexpr Description(const char* struct_name, const char* text, std::tuple<Field<Get>...> struct_fields)
      : name(struct_name), description(text), fields(struct_fields) {}

  const char* name;  //!< null: it is in no file
  const char* description;
  std::tuple<Field<Get>...> fields;
};

//! A struct that is one of several: a file chooses it by its name as `type`.
template <typename... Get>
struct Alternative : Description<Get...> {
  static constexpr bool is_alternative = true;

  constexpr Alternative(const char* struct_name, const char* text, Field<Get>... struct_fields)
      : Description<Get...>(struct_name, text, struct_fields...) {}
  constexpr Alternative(const char* struct_name, const char* text, std::tuple<Field<Get>...> struct_fields)
      : Description<Get...>(struct_name, text, struct_fields) {}
};

//! A struct is a record if there is a `describe(Type<Struct>)`.
template <typename Struct, typename = void>
inline constexpr bool is_record = false;
template <typename Struct>
inline constexpr bool is_record<Struct, std::void_t<decltype(describe(Type<Struct>{}))>> = true;

//! That description.
template <typename Struct>
inline constexpr auto record_of = describe(Type<Struct>{});

//! A struct whose fields have their defaults.
template <typename Struct>
Struct initial() {
  return {};
}

//! Whether a file chooses a struct by its type.
template <typename Struct>
constexpr bool has_type() {
  if constexpr (is_record<Struct>) return decltype(describe(Type<Struct>{}))::is_alternative;
  return false;
}

//! Calls `visit(field)` for each field of a struct.
template <typename Struct, typename Visit>
void visit_fields(const Visit& visit) {
  std::apply([&](const auto&... field) { (visit(field), ...); }, record_of<Struct>.fields);
}

template <typename Visit, typename... Alternatives>
void visit_types(const Visit& visit, Type<std::variant<Alternatives...>>) {
  const auto visit_one = [&](auto alternative) {
    if constexpr (has_type<typename decltype(alternative)::type>()) visit(alternative);
  };
  (visit_one(Type<Alternatives>{}), ...);
}

//! Calls `visit(Type<Alternative>{})` for each alternative of a variant that a file can choose by its type.
template <typename Variant, typename Visit>
void visit_types(const Visit& visit) {
  visit_types(visit, Type<Variant>{});
}

//! The type of a field's member.
template <typename Struct, typename Get>
using Member = std::decay_t<std::invoke_result_t<const Get&, const Struct&>>;

template <typename Struct>
void require_fields(const Struct& object, const std::string& prefix = "");

inline void require_form(const std::string& name, double value, Form form) {
  const auto require = [&](bool holds, const char* expected) {
    if (!holds) reject(name, text(value), expected);
  };
  const double size = std::abs(value);
  if (form == Form::positive) return require_positive(name, value);
  if (form == Form::not_negative) return require_not_negative(name, value);
  if (form == Form::turn)
    return require(size > 0.0 && size <= full_turn, "an angle of at most 2 pi in size, and not 0");
  if (form == Form::half_turn) return require(value >= 0.0 && value <= pi, "an angle from 0 to pi");
  if (form == Form::largest_size) return require(value >= 0.0, "a number of at least 0");
  if (form == Form::lower_limit || form == Form::upper_limit) return require(!std::isnan(value), "a number");
  require_finite(name, value);
}

inline void require_form(const std::string& name, const Vector3& value, Form form) {
  const auto require = [&](bool holds, const char* expected) {
    if (!holds) reject(name, text(value), expected);
  };
  const auto numbers = value.array();
  const bool finite = value.allFinite();
  if (form == Form::direction) return require_unit(name, value);
  if (form == Form::sizes) return require((numbers > 0.0).all(), "three numbers above 0");
  if (form == Form::positive_list) return require(finite && (numbers > 0.0).all(), "three finite numbers above 0");
  if (form == Form::bounds) return require(finite && (numbers >= 0.0).all(), "three finite numbers of at least 0");
  if (form == Form::factors) {
    return require((numbers == 0.0 || numbers == 1.0).all(), "0 (locked) or 1 (free) for each axis");
  }
  if (form != Form::moments) return require_finite(name, value);
  // No two moments are less than the third; rounding in files gets a little room.
  require(finite && (numbers > 0.0).all() && 2.0 * value.maxCoeff() <= value.sum() * (1.0 + 1e-6),
          "three numbers above 0 of which none is greater than the sum of the others");
}

template <typename Value>
void require_form(const std::string& name, const Value& value, Form) {
  if constexpr (std::is_same_v<Value, Vector2>) {
    require_finite(name, Vector3(value.x(), value.y(), 0.0));
  } else if constexpr (std::is_same_v<Value, Quaternion>) {
    require_unit(name, value);
  } else if constexpr (is_record<Value>) {
    require_fields(value, name + ": ");
  }
}

template <typename Value>
void require_form(const std::string& name, const std::optional<Value>& value, Form form) {
  if (value) require_form(name, *value, form);
}

//! Throws std::invalid_argument on a number that is not finite, or not as its field's form wants it.
template <typename Struct>
void require_fields(const Struct& object, const std::string& prefix) {
  visit_fields<Struct>(
      [&](const auto& field) { require_form(prefix + field.name, std::invoke(field.get, object), field.form); });
}

}  // namespace energymargin
