#pragma once
// What Python gives for a value of C++.

#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "base/words.hpp"
#include "given.hpp"

namespace energymargin::binding {

//! What Python gives for a Value, and back. `of` throws an error that names the argument.
template <typename Value, typename = void>
struct Argument {
  using Input = Given<Value>;
  static Value of(const std::string& name, const Input& input) { return given(name, input); }
  static py::object python(const Value& value) {
    if constexpr (std::is_base_of_v<py::object, Value>) {
      return value;
    } else {
      return py::cast(value);
    }
  }
};

template <>
struct Argument<double> {
  using Input = Number;
  static double of(const std::string& name, const Input& input) { return real(name, input); }
  static py::object python(double value) { return py::float_(value); }
};

template <>
struct Argument<int> {
  using Input = WholeNumber;
  static int of(const std::string& name, const Input& input) { return count(name, input); }
  static py::object python(int value) { return py::int_(value); }
};

template <>
struct Argument<std::uint64_t> {
  using Input = WholeNumber;
  static std::uint64_t of(const std::string& name, const Input& input) { return seed(name, input); }
  static py::object python(std::uint64_t value) { return py::int_(value); }
};

template <>
struct Argument<Vector3> {
  using Input = ArrayLike;
  static Vector3 of(const std::string& name, const Input& input) { return vector3(name, input); }
  static py::object python(const Vector3& value) { return py::make_tuple(value.x(), value.y(), value.z()); }
};

template <typename Value>
struct Argument<Value, std::enable_if_t<std::is_enum_v<Value>>> {
  using Input = Given<std::string>;
  static Value of(const std::string& name, const Input& input) { return value_of<Value>(name, given(name, input)); }
  static py::object python(Value value) { return py::str(word_of(value)); }
};

template <typename Value>
struct Argument<std::optional<Value>> {
  using Input = std::optional<typename Argument<Value>::Input>;
  static std::optional<Value> of(const std::string& name, const Input& input) {
    if (!input) return std::nullopt;
    return Argument<Value>::of(name, *input);
  }
  static py::object python(const std::optional<Value>& value) {
    return value ? Argument<Value>::python(*value) : py::none();
  }
};

template <>
struct Argument<std::vector<Vector3>> {
  using Input = ArrayLike;
  static std::vector<Vector3> of(const std::string& name, const Input& input) { return points(name, input); }
};

}  // namespace energymargin::binding
