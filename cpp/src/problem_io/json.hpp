#pragma once
// The JSON of problem files: its text, its names, and its two directions; and its values while they are read.

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/words.hpp"
#include "energymargin/plausibility.hpp"
#include "energymargin/problem.hpp"
#include "energymargin/problem_io.hpp"

namespace energymargin::problem_io {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;  //!< keeps its keys in the order in which they were written

inline constexpr const char* format_name = "energymargin-problem";

//! Throws std::invalid_argument that names the line and the place at which the text stops being JSON, and the place of
//! a number beyond all bounds, of a key that is given twice, and of nesting without end.
Json parse(const std::string& text, const std::string& what = "a problem");

//! Mesh files are looked for in `folder`; empty: there is none. `warnings` as in from_json. Throws
//! std::invalid_argument that names the place in the file and what was expected there.
Problem read_problem(const Json& json, const std::string& folder, std::vector<Warning>* warnings = nullptr,
                     const Policies& policies = {});

//! Rows are packed.
OrderedJson write(const Plan& plan);

//! A plan alone, which no scene is there for. Throws as `read_problem`.
Plan read_plan(const Json& json, const Policies& policies);

//! The beginning of a text, for an error message: cut between two of its characters.
inline std::string shortened(std::string text, std::size_t size = 60) {
  if (text.size() <= size) return text;
  size -= 3;
  while (size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0U) == 0x80U) --size;
  return text.substr(0, size) + "...";
}

//! The same in quotes, for any bytes: in one line, and in valid UTF-8.
inline std::string in_quotes(const std::string& text) {
  return Json(shortened(text)).dump(-1, ' ', false, Json::error_handler_t::replace);
}

//! A value in a JSON file that is being read: it knows its path, and its type is checked.
class JsonNode {
 public:
  JsonNode(const Json& json, std::string path) : json_(json), path_(std::move(path)) {}

  //! As "scene.bodies[1].mass".
  const std::string& path() const { return path_; }

  [[noreturn]] void fail(const std::string& expected) const {
    throw std::invalid_argument(path_ + " is " + shortened(json_.dump()) + ", expected " + expected);
  }

  bool has(const std::string& key) const { return object().contains(key); }

  JsonNode operator[](const std::string& key) const {
    if (!has(key)) throw std::invalid_argument(path_ + " has no \"" + key + "\", expected one");
    return {json_.at(key), path_ == "problem" ? key : path_ + "." + key};
  }

  //! Rejects keys that nobody reads: a misspelt setting must not pass in silence.
  void allow_keys(const std::vector<std::string>& keys) const {
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
  double number_or_infinity() const {
    if (json_.is_string() && json_.get<std::string>() == "inf") return std::numeric_limits<double>::infinity();
    if (json_.is_string() && json_.get<std::string>() == "-inf") return -std::numeric_limits<double>::infinity();
    if (!json_.is_number()) fail("a number, \"inf\" or \"-inf\"");
    return json_.get<double>();
  }
  bool boolean() const {
    if (!json_.is_boolean()) fail("true or false");
    return json_.get<bool>();
  }
  int integer() const {
    if (!json_.is_number_integer()) fail("a whole number");
    const double value = json_.get<double>();  // one beyond 64 bits, too, is a number
    if (std::abs(value) > std::numeric_limits<int>::max()) fail("a smaller number");
    return json_.get<int>();
  }
  bool is_text() const { return json_.is_string(); }
  std::string text() const {
    if (!json_.is_string()) fail("a text");
    return json_.get<std::string>();
  }
  template <typename Enum>
  Enum one_of() const {
    const auto value = value_of<Enum>(text());
    if (!value) fail("one of " + alternatives(all_words<Enum>(), "\"", ", "));
    return *value;
  }
  bool is_list() const { return json_.is_array(); }
  std::vector<JsonNode> items() const {
    if (!json_.is_array()) fail("a list");
    std::vector<JsonNode> nodes;
    for (std::size_t i = 0; i < json_.size(); ++i) nodes.emplace_back(json_[i], path_ + "[" + std::to_string(i) + "]");
    return nodes;
  }
  std::vector<double> all_numbers(bool infinite = false) const {
    std::vector<double> values;
    for (const JsonNode& node : items()) values.push_back(infinite ? node.number_or_infinity() : node.number());
    return values;
  }
  std::vector<double> numbers(std::size_t count, bool infinite = false) const {
    if (items().size() != count) fail("a list of " + std::to_string(count) + " numbers");
    return all_numbers(infinite);
  }
  template <int Size>
  Eigen::Matrix<double, Size, 1> vector(bool infinite = false) const {
    return Eigen::Map<const Eigen::Matrix<double, Size, 1>>(numbers(Size, infinite).data());
  }

 private:
  const Json& object() const {
    if (!json_.is_object()) fail("an object { }");
    return json_;
  }

  const Json& json_;
  std::string path_;
};

//! What `read` makes of a node; an error that does not name the node gets its path.
template <typename Read>
auto with_path(const JsonNode& node, const Read& read) {
  try {
    return read(node);
  } catch (const std::invalid_argument& error) {
    const std::string what = error.what();
    throw std::invalid_argument(what.rfind(node.path(), 0) == 0 ? what : node.path() + ": " + what);
  }
}

//! Calls `read(item)` for each item of a list, if the node has one under `key`; an error says where.
template <typename Read>
void for_each_item(const JsonNode& node, const std::string& key, const Read& read) {
  if (!node.has(key)) return;
  for (const JsonNode& item : node[key].items()) with_path(item, read);
}

}  // namespace energymargin::problem_io
