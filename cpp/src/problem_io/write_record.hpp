#pragma once
// Structs as JSON, by the description of their fields.

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/record.hpp"
#include "base/words.hpp"
#include "problem_io/json.hpp"

namespace energymargin::problem_io {

//! JSON has no infinity; a number without limit is the word.
inline OrderedJson write(double value) {
  if (!std::isinf(value)) return value;
  return value > 0.0 ? "inf" : "-inf";
}
inline OrderedJson write(const std::string& text) { return text; }
inline OrderedJson write(const Vector2& v) { return {write(v.x()), write(v.y())}; }
inline OrderedJson write(const Vector3& v) { return {write(v.x()), write(v.y()), write(v.z())}; }
inline OrderedJson write(const Quaternion& q) { return {q.x(), q.y(), q.z(), q.w()}; }

//! Throws std::invalid_argument.
OrderedJson write(const regions::Predicate& predicate);
OrderedJson write(const Region& region);

template <typename Value>
OrderedJson write(const Value& value);
template <typename Value>
OrderedJson write(const std::optional<Value>& value);
template <typename Value>
OrderedJson write(const std::vector<Value>& values);
template <typename... Alternatives>
OrderedJson write(const std::variant<Alternatives...>& value);

template <typename Value>
bool is_default(const Value& value, const Value& initial) {
  if constexpr (std::is_arithmetic_v<Value> || std::is_enum_v<Value> || std::is_same_v<Value, std::string>)
    return value == initial;
  if constexpr (std::is_same_v<Value, Vector3>) return value == initial;
  return false;
}
template <typename Value>
bool is_default(const std::optional<Value>& value, const std::optional<Value>&) {
  return !value;
}

//! Adds the fields, but for those that may be left out and are at their defaults.
template <typename Struct>
void write_fields(const Struct& object, OrderedJson& json) {
  const auto defaults = initial<Struct>();
  visit_fields<Struct>([&](const auto& field) {
    const auto& value = std::invoke(field.get, object);
    if (field.presence == Presence::optional && is_default(value, std::invoke(field.get, defaults))) return;
    json[field.name] = write(value);
  });
}

template <typename Struct>
OrderedJson write_record(const Struct& object) {
  OrderedJson json = OrderedJson::object();
  if constexpr (has_type<Struct>) json["type"] = Record<Struct>::type;
  write_fields(object, json);
  return json;
}

template <typename Value>
OrderedJson write(const std::optional<Value>& value) {
  return write(value.value());
}

template <typename Value>
OrderedJson write(const Value& value) {
  if constexpr (std::is_same_v<Value, bool>) {
    return value;
  } else if constexpr (std::is_enum_v<Value>) {
    return word_of(value);
  } else {
    return write_record(value);
  }
}

template <typename Value>
OrderedJson write(const std::vector<Value>& values) {
  OrderedJson list = OrderedJson::array();
  for (const Value& value : values) list.push_back(write(value));
  return list;
}

template <typename... Alternatives>
OrderedJson write(const std::variant<Alternatives...>& value) {
  return std::visit([](const auto& alternative) { return write(alternative); }, value);
}

}  // namespace energymargin::problem_io
