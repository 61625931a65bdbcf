#pragma once
// Structs from JSON, by the description of their fields.

#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/record.hpp"
#include "problem_io/json_node.hpp"
#include "problem_io/read.hpp"

namespace energymargin::problem_io {

//! The keys that a struct has in a file.
template <typename Struct>
std::vector<std::string> keys_of() {
  std::vector<std::string> keys;
  if constexpr (has_type<Struct>) keys.emplace_back("type");
  visit_fields<Struct>([&](const auto& field) { keys.emplace_back(field.name); });
  return keys;
}

class RecordReader {
 public:
  //! Names of bodies have to be in `scene`. Mesh files are looked for in `folder`; empty: there is none.
  explicit RecordReader(const Scene* scene = nullptr, std::string folder = "")
      : scene_(scene), folder_(std::move(folder)) {}

  template <typename Struct>
  Struct record(const JsonNode& node) const {
    node.allow_keys(keys_of<Struct>());
    Struct object;
    visit_fields<Struct>([&](const auto& field) {
      if (field.presence != Presence::required && !node.has(field.name)) return;
      read(node[field.name], field.form, std::invoke(field.get, object));
    });
    return object;
  }

 private:
  void read(const JsonNode& node, const Form& form, double& value) const {
    value = form.infinite ? node.number_or_infinity() : node.number();
  }
  void read(const JsonNode& node, const Form& form, std::string& value) const {
    value = form.names_body ? read_body_name(node, *scene_) : node.text();
  }
  void read(const JsonNode& node, const Form&, Vector2& value) const { value = node.vector2(); }
  void read(const JsonNode& node, const Form& form, Vector3& value) const { value = node.vector3(form.infinite); }
  void read(const JsonNode& node, const Form&, Quaternion& value) const { value = node.quaternion(); }
  void read(const JsonNode& node, const Form&, Solid& value) const { value = read_solid(node); }
  void read(const JsonNode& node, const Form&, Shape& value) const { value = read_shape(node, folder_); }

  template <typename Value>
  void read(const JsonNode& node, const Form& form, std::optional<Value>& value) const {
    read(node, form, value.emplace());
  }
  template <typename Value>
  void read(const JsonNode& node, const Form&, std::vector<Value>& values) const {
    for (const JsonNode& item : node.items()) read(item, Form{}, values.emplace_back());
  }
  template <typename Value>
  void read(const JsonNode& node, const Form&, Value& value) const {
    if constexpr (std::is_same_v<Value, bool>) {
      value = node.boolean();
    } else if constexpr (std::is_enum_v<Value>) {
      value = node.one_of<Value>();
    } else {
      value = record<Value>(node);
    }
  }

  const Scene* scene_;
  std::string folder_;
};

//! The types of a variant's alternatives, each in quotes.
template <typename Variant>
std::vector<std::string> quoted_types() {
  std::vector<std::string> types;
  visit_types<Variant>([&](auto alternative) {
    types.push_back("\"" + std::string(Record<typename decltype(alternative)::type>::type) + "\"");
  });
  return types;
}

}  // namespace energymargin::problem_io
