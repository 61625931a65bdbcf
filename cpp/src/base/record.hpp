#pragma once
// Structs as records: one description of their fields, from which come the reader and the writer of problem files, the
// files' schema, and the Python classes.

#include <string_view>
#include <tuple>
#include <type_traits>
#include <variant>

namespace energymargin {

//! Which values a field may have: a definition of the schema. Unset: what the C++ type says.
struct Form {
  const char* definition = nullptr;
  bool infinite = false;    //!< "inf" and "-inf" stand for numbers
  bool names_body = false;  //!< the text is the name of a body of the scene

  //! By the words: equal literals need not have one address.
  bool operator==(const Form& other) const { return words() == other.words(); }

 private:
  std::string_view words() const { return definition ? definition : ""; }
};

namespace forms {

inline constexpr Form any{};
inline constexpr Form positive{"positive"};
inline constexpr Form not_negative{"not_negative"};
inline constexpr Form positive_list{"positive_list"};
inline constexpr Form points{"points"};
inline constexpr Form direction{"direction"};
inline constexpr Form bounds{"bounds"};
inline constexpr Form factors{"factors"};
inline constexpr Form moments{"moments"};
inline constexpr Form lower_limit{"number_or_minus_inf", true};
inline constexpr Form upper_limit{"number_or_inf", true};
inline constexpr Form largest_size{"not_negative_or_inf", true};
inline constexpr Form sizes{"sizes_or_inf", true};
inline constexpr Form turn{"turn"};
inline constexpr Form half_turn{"half_turn"};
inline constexpr Form body{"name", false, true};
inline constexpr Form frame{"frame", false, true};
inline constexpr Form regions{"regions"};
inline constexpr Form region{"one_region"};

}  // namespace forms

//! Whether a file has a field.
enum class Presence {
  required,
  added,     ///< written always; files of older versions lack it
  optional,  ///< written unless it has its default: of numbers, texts, enums and std::optional
};

//! One field of a struct. `get` is a pointer to a member, or a function from an object to a reference to the member.
template <typename Get>
struct Field {
  constexpr Field(const char* field_name, Get access, const char* text, Form values = {},
                  Presence in_files = Presence::required)
      : name(field_name), get(access), description(text), form(values), presence(in_files) {}
  constexpr Field(const char* field_name, Get access, const char* text, Presence in_files)
      : Field(field_name, access, text, {}, in_files) {}

  const char* name;
  Get get;
  const char* description;  //!< null: that of the form
  Form form;
  Presence presence;
};

//! Of a struct: `name` and `description` in the schema, and `fields()`, a tuple in the order of files. A struct that is
//! one alternative of several has a `type`, by which a file chooses it.
template <typename Struct>
struct Record;

//! Whether a struct has a `type`.
template <typename Struct, typename = void>
inline constexpr bool has_type = false;
template <typename Struct>
inline constexpr bool has_type<Struct, std::void_t<decltype(Record<Struct>::type)>> = true;

template <typename Struct, typename = void>
inline constexpr bool is_record = false;
template <typename Struct>
inline constexpr bool is_record<Struct, std::void_t<decltype(Record<Struct>::fields())>> = true;

//! Calls `visit(field)` for each field of a struct.
template <typename Struct, typename Visit>
void visit_fields(const Visit& visit) {
  std::apply([&](const auto&... field) { (visit(field), ...); }, Record<Struct>::fields());
}

//! A type as a value.
template <typename T>
struct Type {
  using type = T;
};

template <typename Visit, typename... Alternatives>
void visit_types(const Visit& visit, Type<std::variant<Alternatives...>>) {
  const auto visit_one = [&](auto alternative) {
    if constexpr (has_type<typename decltype(alternative)::type>) visit(alternative);
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

}  // namespace energymargin
