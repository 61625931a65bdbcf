#pragma once
// Values of classes, functions and text. An error names the argument, its value and what was expected.

#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "convert.hpp"

namespace energymargin::binding {

//! What a Value is in Python, in words: "a Scene", "True or False".
template <typename Value>
struct Words {
  static std::string text() {
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
};

template <typename Value>
struct Words<std::shared_ptr<Value>> : Words<Value> {};

template <typename Value>
struct Words<std::vector<Value>> {
  static std::string text() { return "a list, each item " + Words<Value>::text(); }
};

template <typename... Values>
struct Words<std::variant<Values...>> {
  static std::string text() {
    const std::vector<std::string> words{Words<Values>::text()...};
    std::string text = words.front();
    for (std::size_t i = 1; i < words.size(); ++i) text += (i + 1 < words.size() ? ", " : " or ") + words[i];
    return text;
  }
};

[[noreturn]] inline void refuse(const std::string& name, const py::handle& value, const std::string& expected) {
  throw py::type_error(name + " is " + short_repr(value) + ", expected " + expected);
}

//! The Value that was given. Throws TypeError that names the argument.
template <typename Value>
Value given(const std::string& name, const Given<Value>& input, const std::string& expected = Words<Value>::text()) {
  if constexpr (std::is_base_of_v<py::object, Value>) {
    if (py::isinstance<Value>(input.value)) return py::reinterpret_borrow<Value>(input.value);
  } else {
    try {
      return input.value.template cast<Value>();
    } catch (const py::builtin_exception&) {  // cast_error, and reference_cast_error of None
    }
  }
  refuse(name, input.value, expected);
}

template <typename Value>
std::optional<Value> given(const std::string& name, const std::optional<Given<Value>>& input,
                           const std::string& expected = Words<Value>::text()) {
  if (!input) return std::nullopt;
  return given(name, *input, expected);
}

//! The object of a class that was given, itself and no copy.
template <typename Value>
const Value& given_object(const std::string& name, const Given<Value>& input) {
  if (!py::isinstance<Value>(input.value)) refuse(name, input.value, Words<Value>::text());
  return input.value.template cast<const Value&>();
}

}  // namespace energymargin::binding
