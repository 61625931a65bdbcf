#pragma once
// Structs from JSON, and as JSON, by the description of their fields.

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/record.hpp"
#include "problem_io/json.hpp"
#include "problem_io/mesh.hpp"
#include "scene/records.hpp"
#include "sets/records.hpp"

namespace energymargin::problem_io {

//! The convex parts in the file that the node names. Throws std::invalid_argument.
Compound read_mesh_file(const JsonNode& node, const std::string& folder);

//! A plan that fits the scene or, where there is none, one that may fit some scene.
Plan read_plan(const JsonNode& node, const Scene* scene, const Policies& policies);

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
  explicit RecordReader(const Scene* scene = nullptr, std::string folder = "", Policies policies = {})
      : scene_(scene), folder_(std::move(folder)), policies_(std::move(policies)) {}

  template <typename Struct>
  Struct record(const JsonNode& node) const {
    Struct object;
    read_fields(node, object, std::vector<std::string>(has_type<Struct>() ? 1 : 0, "type"));
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
  void read(const JsonNode& node, Form, Plan& plan) const { plan = read_plan(node, scene_, policies_); }
  void read(const JsonNode& node, Form, Region& set) const { set = region(node); }
  void read(const JsonNode& node, Form, std::optional<Region>& set) const { set = region(node); }
  void read(const JsonNode& node, Form, Solid& value) const { read_alternative(node, value); }
  void read(const JsonNode& node, Form, Shape& value) const {
    if (node["type"].text() != record_of<MeshShape>.name) return read_alternative(node, value, {"\"mesh\""});
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
      types.push_back("\"" + std::string(record_of<Alternative>.name) + "\"");
      if (type != record_of<Alternative>.name) return;
      value = record<Alternative>(node);
      known = true;
    });
    if (!known) node["type"].fail(alternatives(types, ""));
  }

  const Scene* scene_;
  std::string folder_;
  Policies policies_;
  int depth_ = 0;  // levels of "and", "or", "not" above
};

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
  if constexpr (has_type<Struct>()) json["type"] = record_of<Struct>.name;
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
