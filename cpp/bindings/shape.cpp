// Shapes and mass properties for Python.

#include "energymargin/shape.hpp"

#include <cctype>

#include "records.hpp"
#include "scene/records.hpp"

namespace energymargin::binding {
namespace {

constexpr const char* compound_doc = R"(Several solids that move as one.

parts: Parts, or solids that stand at the body's frame; without any there is nothing to collide with. solid: the mass
properties, for a mass of 1 kg, of the solid that the parts stand for, as for a mesh; by default those of the parts
together. Raises ValueError on values that no solid can have.)";

template <typename Shape>
py::class_<Shape> bind_shape(py::module_& module) {
  py::class_<Shape> type(module, class_name(record_of<Shape>.name).c_str(), record_of<Shape>.description);
  def_fields(type, record_of<Shape>.fields);
  return type;
}

void bind_solids(py::module_& module) {
  visit_types<Solid>([&](auto alternative) {
    using Shape = typename decltype(alternative)::type;
    py::class_<Shape> type = bind_shape<Shape>(module);
    def_fields_constructor(
        type, {}, +[](Shape shape) {
          validate(shape);
          return shape;
        });
    if constexpr (std::is_same_v<Shape, ConvexHull>) {
      type.def("centered", &centered, "The hull with its centre of mass moved to the origin.");
    }
  });
}

// A part from a Part, or from a bare solid at the body's frame.
Part part(const std::variant<Part, Solid>& either) {
  if (const auto* solid = std::get_if<Solid>(&either)) return {*solid, {}};
  return std::get<Part>(either);
}

void bind_compound(py::module_& module) {
  py::class_<Compound> type(module, "Compound", compound_doc);
  type.def(
      py::init([](const std::vector<std::variant<Part, Solid>>& parts, const std::optional<MassProperties>& solid) {
        Compound compound;
        for (const auto& either : parts) compound.parts.push_back(part(either));
        compound.solid = solid;
        validate(compound);
        return compound;
      }),
      py::arg("parts"), py::arg("solid") = py::none());
  def_fields(type, record_of<Compound>.fields);
}

}  // namespace

std::string class_name(const std::string& type) {
  std::string name;
  for (std::size_t i = 0; i < type.size(); ++i) {
    const bool first = i == 0 || type[i - 1] == '_';
    if (type[i] != '_') name += first ? static_cast<char>(std::toupper(static_cast<unsigned char>(type[i]))) : type[i];
  }
  return name;
}

void bind_shapes(py::module_& module) {
  bind_shape<Plane>(module);
  bind_solids(module);
  bind_record<Part>(module, "Part", "A solid at its place in a Compound: position [m] and orientation (x, y, z, w).",
                    {99, {"position", "orientation"}});
  bind_record<MassProperties>(module, "MassProperties",
                              "Volume, centre of mass and inertia of a solid of even density and of the given mass, 1 "
                              "kg by default. The inertia of another mass is in proportion.",
                              {99, {"axes"}});
  bind_compound(module);
  module.def(
      "mass_properties",
      [](const Given<Shape>& shape, const Given<double>& mass) {
        const double kilograms = given("mass", mass);
        require_not_negative("mass", kilograms);
        return mass_properties(given("shape", shape), kilograms);
      },
      py::arg("shape"), py::arg("mass") = 1.0, "Mass properties of a solid shape of a mass [kg], of even density.");
}

}  // namespace energymargin::binding
