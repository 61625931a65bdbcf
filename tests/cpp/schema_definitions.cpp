#include "schema_definitions.hpp"

#include <algorithm>

#include "problem/records.hpp"
#include "problem_io/mesh.hpp"
#include "scene/records.hpp"
#include "sets/records.hpp"

namespace energymargin::problem_io {
namespace {

// The definition of a form's values; none where the type says it.
const char* definition_of(Form form) {
  switch (form) {
    case Form::any:
      return nullptr;
    case Form::positive:
      return "positive";
    case Form::not_negative:
      return "not_negative";
    case Form::positive_list:
      return "positive_list";
    case Form::points:
      return "points";
    case Form::direction:
      return "direction";
    case Form::bounds:
      return "bounds";
    case Form::factors:
      return "factors";
    case Form::moments:
      return "moments";
    case Form::lower_limit:
      return "number_or_minus_inf";
    case Form::upper_limit:
      return "number_or_inf";
    case Form::largest_size:
      return "not_negative_or_inf";
    case Form::sizes:
      return "sizes_or_inf";
    case Form::turn:
      return "turn";
    case Form::half_turn:
      return "half_turn";
    case Form::body:
      return "name";
    case Form::frame:
      return "frame";
    case Form::regions:
      return "regions";
    case Form::region:
      return "one_region";
  }
  return nullptr;
}

// The types of two regions are names of a shape and of a joint, too.
template <typename Struct>
std::string name_of() {
  const bool is_taken = std::is_same_v<Struct, regions::Box> || std::is_same_v<Struct, regions::Joint>;
  return std::string(record_of<Struct>.name) + (is_taken ? "_region" : "");
}

OrderedJson reference(const std::string& definition) { return {{"$ref", "#/definitions/" + definition}}; }

// The schema of any value of a type.
OrderedJson values_of(Type<double>) { return {{"type", "number"}}; }
OrderedJson values_of(Type<bool>) { return {{"type", "boolean"}}; }
OrderedJson values_of(Type<std::string>) { return reference("name"); }
OrderedJson values_of(Type<Vector2>) { return reference("vector2"); }
OrderedJson values_of(Type<Vector3>) { return reference("vector3"); }
OrderedJson values_of(Type<Quaternion>) { return reference("orientation"); }
OrderedJson values_of(Type<Solid>) { return reference("solid_shape"); }
OrderedJson values_of(Type<Shape>) { return reference("shape"); }
OrderedJson values_of(Type<Region>) { return reference("region"); }

template <typename Value>
OrderedJson values_of(Type<Value>) {
  if constexpr (std::is_enum_v<Value>) {
    OrderedJson list = OrderedJson::array();
    for (const auto& [word, value] : Words<Value>::all) list.push_back(word);
    return {{"enum", list}};
  } else {
    return reference(name_of<Value>());
  }
}
template <typename Value>
OrderedJson values_of(Type<std::optional<Value>>) {
  return values_of(Type<Value>{});
}
template <typename Value>
OrderedJson values_of(Type<std::vector<Value>>) {
  return {{"type", "array"}, {"items", values_of(Type<Value>{})}};
}

template <typename Struct, typename Get>
OrderedJson property(const Field<Get>& field) {
  const char* definition = definition_of(field.form);
  OrderedJson json = definition ? reference(definition) : values_of(Type<Member<Struct, Get>>{});
  if (field.description) json["description"] = field.description;
  return json;
}

template <typename Struct>
OrderedJson object_with_fields() {
  OrderedJson required = OrderedJson::array();
  OrderedJson properties = OrderedJson::object();
  if constexpr (has_type<Struct>()) {
    required.push_back("type");
    properties["type"] = {{"const", record_of<Struct>.name}};
  }
  visit_fields<Struct>([&](const auto& field) {
    if (field.presence == Presence::required) required.push_back(field.name);
    properties[field.name] = property<Struct>(field);
  });
  return {{"type", "object"}, {"additionalProperties", false}, {"required", required}, {"properties", properties}};
}

template <typename Struct>
void define(OrderedJson& definitions) {
  OrderedJson definition = OrderedJson::object();
  if constexpr (has_type<Struct>()) {
    std::string title = record_of<Struct>.name;
    std::replace(title.begin(), title.end(), '_', ' ');
    definition["title"] = title;
  }
  definition["description"] = record_of<Struct>.description;
  definition.update(object_with_fields<Struct>());
  definitions[name_of<Struct>()] = definition;
}

// An object that is one of several: its type says which.
class Choice {
 public:
  template <typename Struct>
  void add() {
    types_.push_back(record_of<Struct>.name);
    branches_.push_back({{"if", {{"properties", {{"type", {{"const", record_of<Struct>.name}}}}}}},
                         {"then", reference(name_of<Struct>())}});
  }

  template <typename Variant>
  void add_each() {
    visit_types<Variant>([this](auto alternative) { this->template add<typename decltype(alternative)::type>(); });
  }

  OrderedJson definition(const char* description, const char* question) const {
    return {{"description", description},
            {"type", "object"},
            {"required", OrderedJson::array({"type"})},
            {"properties", {{"type", {{"enum", types_}, {"description", question}}}}},
            {"allOf", branches_}};
  }

 private:
  OrderedJson types_ = OrderedJson::array();
  OrderedJson branches_ = OrderedJson::array();
};

template <typename Variant>
void define_each(OrderedJson& definitions) {
  visit_types<Variant>([&](auto alternative) { define<typename decltype(alternative)::type>(definitions); });
}

void define_choices(OrderedJson& definitions) {
  Choice solids;
  solids.add_each<Solid>();
  definitions["solid_shape"] = solids.definition("A solid about its own origin.", "Which solid.");
  Choice shapes;
  shapes.add_each<Shape>();
  shapes.add<MeshShape>();
  definitions["shape"] =
      shapes.definition("What a body looks like to others that it meets. Its frame is the body's.", "Which shape.");
  Choice regions;
  regions.add_each<Region::Expression>();
  definitions["region"] = regions.definition("A set of states.", "Which set.");
}

}  // namespace

OrderedJson schema_definitions() {
  OrderedJson definitions = OrderedJson::object();
  define<Pose>(definitions);
  define_each<Shape>(definitions);
  define<MeshShape>(definitions);
  define<Part>(definitions);
  define<MassProperties>(definitions);
  define<Inertial>(definitions);
  define<Surface>(definitions);
  define<Body>(definitions);
  define<Joint>(definitions);
  define<Mimic>(definitions);
  define<Tendon>(definitions);
  define<TendonJoint>(definitions);
  define<Loop>(definitions);
  define<Spring>(definitions);
  define<PairFriction>(definitions);
  define_each<Region::Expression>(definitions);
  define<regions::PlanarMotion>(definitions);
  define<ForceWeights>(definitions);
  define<Contact>(definitions);
  define_choices(definitions);
  return definitions;
}

}  // namespace energymargin::problem_io
