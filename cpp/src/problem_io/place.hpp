#pragma once
// A place in a JSON file that is being read: it knows its path, and what it finds is checked.

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "energymargin/types.hpp"
#include "problem_io/json.hpp"
#include "problem_io/text.hpp"

namespace energymargin::problem_io {

//! A place in the file, for error messages: "scene.bodies[1].mass".
class Place {
 public:
  Place(const Json& json, std::string path) : json_(json), path_(std::move(path)) {}

  const std::string& path() const { return path_; }

  [[noreturn]] void fail(const std::string& expected) const {
    throw std::invalid_argument(path_ + " is " + shortened(json_.dump()) + ", expected " + expected);
  }

  bool has(const std::string& key) const { return object().contains(key); }

  Place operator[](const std::string& key) const {
    if (!has(key)) throw std::invalid_argument(path_ + " has no \"" + key + "\", expected one");
    return {json_.at(key), path_ == "problem" ? key : path_ + "." + key};
  }

  //! Rejects keys that nobody reads: a misspelt setting must not pass in silence.
  void only(const std::vector<std::string>& keys) const {
    for (const auto& [key, value] : object().items()) {
      if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
        std::string known;
        for (const std::string& name : keys) known += (known.empty() ? "" : ", ") + name;
        throw std::invalid_argument(path_ + " has an unknown " + in_quotes(key) + ", expected only " + known);
      }
    }
  }

  double number() const {
    if (!json_.is_number()) fail("a number");
    return json_.get<double>();
  }
  double size() const {
    if (json_.is_string() && json_.get<std::string>() == "inf") return std::numeric_limits<double>::infinity();
    if (json_.is_string() && json_.get<std::string>() == "-inf") return -std::numeric_limits<double>::infinity();
    if (!json_.is_number()) fail("a number, \"inf\" or \"-inf\"");
    return json_.get<double>();
  }
  bool truth() const {
    if (!json_.is_boolean()) fail("true or false");
    return json_.get<bool>();
  }
  int integer() const {
    if (!json_.is_number_integer()) fail("a whole number");
    const double value = json_.get<double>();  // one beyond 64 bits, too, is a number
    if (std::abs(value) > std::numeric_limits<int>::max()) fail("a smaller number");
    return json_.get<int>();
  }
  std::string word() const {
    if (!json_.is_string()) fail("a text");
    return json_.get<std::string>();
  }
  bool is_list() const { return json_.is_array(); }
  bool is_text() const { return json_.is_string(); }
  std::vector<Place> items() const {
    if (!json_.is_array()) fail("a list");
    std::vector<Place> places;
    for (std::size_t i = 0; i < json_.size(); ++i) places.emplace_back(json_[i], path_ + "[" + std::to_string(i) + "]");
    return places;
  }
  std::vector<double> numbers(std::size_t count) const {
    const std::vector<Place> places = items();
    if (places.size() != count) fail("a list of " + std::to_string(count) + " numbers");
    std::vector<double> values;
    for (const Place& place : places) values.push_back(place.number());
    return values;
  }
  Vector2 vector2() const {
    const auto v = numbers(2);
    return {v[0], v[1]};
  }
  Vector3 vector3() const {
    const auto v = numbers(3);
    return {v[0], v[1], v[2]};
  }
  Quaternion quaternion() const {
    const auto v = numbers(4);
    return {v[3], v[0], v[1], v[2]};
  }
  template <typename Value>
  Value one_of(const std::vector<std::pair<const char*, Value>>& names) const {
    std::string known;
    for (const auto& [name, value] : names) {
      if (word() == name) return value;
      known += (known.empty() ? "\"" : ", \"") + std::string(name) + "\"";
    }
    fail("one of " + known);
  }

 private:
  const Json& object() const {
    if (!json_.is_object()) fail("an object { }");
    return json_;
  }

  const Json& json_;
  std::string path_;
};

//! What `read` makes of a place; an error in it that does not name the place gets its path.
template <typename Read>
auto located(const Place& place, const Read& read) {
  try {
    return read(place);
  } catch (const std::invalid_argument& error) {
    const std::string what = error.what();
    throw std::invalid_argument(what.rfind(place.path(), 0) == 0 ? what : place.path() + ": " + what);
  }
}

//! Reads each item of a list, if there is one, and adds it; an error says where.
template <typename Add>
void add_each(const Place& place, const std::string& key, const Add& add) {
  if (!place.has(key)) return;
  for (const Place& item : place[key].items()) located(item, add);
}

}  // namespace energymargin::problem_io
