#pragma once
// Structs from JSON, by the description of their fields.

#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/record.hpp"
#include "problem_io/json_node.hpp"
#include "problem_io/mesh.hpp"
#include "scene/records.hpp"
#include "sets/records.hpp"

namespace energymargin::problem_io {

//! The convex parts in the file that the node names. Throws std::invalid_argument.
Compound read_mesh_file(const JsonNode& node, const std::string& folder);

//! A plan that fits the scene or, where there is none, one that may fit some scene.
Plan read_plan(const JsonNode& node, const Scene* scene);

//! The name of one of the items. Throws std::invalid_argument that says `expected` and the names of all.
template <typename Items>
std::string read_name(const JsonNode& node, const Items& items, const std::string& expected) {
  const std::string name = node.text();
  std::vector<std::string> known;
  for (const auto& item : items) {
    if (item.name == name) return name;
    known.push_back(item.name);
  }
  node.fail(expected + alternatives(known, "'", ", "));
}

inline std::string read_body_name(const JsonNode& node, const Scene& scene) {
  return read_name(node, scene.bodies(), "one of the bodies ");
}

class RecordReader {
 public:
  //! Names of bodies have to be in `scene`. Mesh files are looked for in `folder`; empty: there is none.
  explicit RecordReader(const Scene* scene = nullptr, std::string folder = "")
      : scene_(scene), folder_(std::move(folder)) {}

  template <typename Struct>
  Struct record(const JsonNode& node) const {
    Struct object;
    read_fields(node, object, std::vector<std::string>(has_type<Struct> ? 1 : 0, "type"));
    return object;
  }

  //! `keys` are those that the node may have besides the fields.
  template <typename Struct>
  void read_fields(const JsonNode& node, Struct& object, std::vector<std::string> keys) const {
    visit_fields<Struct>([&](const auto& field) { keys.emplace_back(field.name); });
    node.allow_keys(keys);
    visit_fields<Struct>([&](const auto& field) {
      if (field.presence != Presence::required && !node.has(field.name)) return;
      read(node[field.name], field.form, std::invoke(field.get, object));
    });
  }

  Region region(const JsonNode& node) const {
    return with_path(node, [this](const JsonNode& at) {
      if (depth_ > most_region_levels) {
        at.fail("at most " + std::to_string(most_region_levels) + " levels of \"and\", \"or\", \"not\"");
      }
      Region::Expression expression;
      read_alternative(at, expression);
      return Region(std::move(expression));
    });
  }

 private:
  void read(const JsonNode& node, Form form, double& value) const {
    value = may_be_infinite(form) ? node.number_or_infinity() : node.number();
  }
  void read(const JsonNode& node, Form form, std::string& value) const {
    value = form == Form::body || form == Form::frame ? read_body_name(node, *scene_) : node.text();
  }
  void read(const JsonNode& node, Form, Vector2& value) const { value = node.vector<2>(); }
  void read(const JsonNode& node, Form form, Vector3& value) const { value = node.vector<3>(may_be_infinite(form)); }
  void read(const JsonNode& node, Form, Quaternion& value) const { value.coeffs() = node.vector<4>(); }
  void read(const JsonNode& node, Form, Plan& plan) const { plan = read_plan(node, scene_); }
  void read(const JsonNode& node, Form, Region& set) const { set = region(node); }
  void read(const JsonNode& node, Form, std::optional<Region>& set) const { set = region(node); }
  void read(const JsonNode& node, Form, Solid& value) const { read_alternative(node, value); }
  void read(const JsonNode& node, Form, Shape& value) const {
    if (node["type"].text() != Record<MeshShape>::type) return read_alternative(node, value, {"\"mesh\""});
    const auto mesh = record<MeshShape>(node);
    Compound compound = read_mesh_file(node["file"], folder_);
    compound.solid = mesh.solid;
    value = std::move(compound);
  }
  void read(const JsonNode& node, Form form, std::vector<Region>& regions) const {
    RecordReader deeper = *this;
    ++deeper.depth_;
    for (const JsonNode& item : node.items()) regions.push_back(deeper.region(item));
    const bool single = form == Form::region;
    if (regions.empty() || (single && regions.size() != 1)) {
      node.fail(single ? "a list of one region" : "a list of at least one region");
    }
  }
  template <typename Value>
  void read(const JsonNode& node, Form form, std::optional<Value>& value) const {
    read(node, form, value.emplace());
  }
  template <typename Value>
  void read(const JsonNode& node, Form, std::vector<Value>& values) const {
    for (const JsonNode& item : node.items()) read(item, Form::any, values.emplace_back());
  }
  template <typename Value>
  void read(const JsonNode& node, Form, Value& value) const {
    if constexpr (std::is_same_v<Value, bool>) {
      value = node.boolean();
    } else if constexpr (std::is_enum_v<Value>) {
      value = node.one_of<Value>();
    } else {
      value = record<Value>(node);
    }
  }

  // The alternative that the node's type names.
  template <typename... Alternatives>
  void read_alternative(const JsonNode& node, std::variant<Alternatives...>& value,
                        std::vector<std::string> types = {}) const {
    const std::string type = node["type"].text();
    bool known = false;
    visit_types<std::variant<Alternatives...>>([&](auto alternative) {
      using Alternative = typename decltype(alternative)::type;
      types.push_back("\"" + std::string(Record<Alternative>::type) + "\"");
      if (type != Record<Alternative>::type) return;
      value = record<Alternative>(node);
      known = true;
    });
    if (!known) node["type"].fail(alternatives(types, ""));
  }

  const Scene* scene_;
  std::string folder_;
  int depth_ = 0;  // levels of "and", "or", "not" above
};

}  // namespace energymargin::problem_io
