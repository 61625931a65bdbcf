#pragma once
// The fields of shapes that are no solids, and of mass properties; solids.hpp has those of solids.

#include <tuple>

#include "base/record.hpp"
#include "energymargin/shape.hpp"

namespace energymargin {

template <>
struct Record<Plane> {
  static constexpr const char* name = "plane";
  static constexpr const char* type = "plane";
  static constexpr const char* description =
      "The half space below a plane, {x : normal . x <= offset}; only fixed bodies have it.";
  static auto fields() {
    return std::tuple{
        Field{"normal", &Plane::normal, "Unit vector out of the solid.", forms::direction},
        Field{"offset", &Plane::offset, "Of the surface along the normal [m]."},
    };
  }
};

template <>
struct Record<MassProperties> {
  static constexpr const char* name = "mass_properties";
  static constexpr const char* description = "Mass properties of a solid, for a mass of 1 kg.";
  static auto fields() {
    return std::tuple{
        Field{"volume", &MassProperties::volume, "[m^3]", forms::positive},
        Field{"center", &MassProperties::center, "Centre of mass in the shape's frame [m]."},
        Field{"moments", &MassProperties::moments, "Principal moments about the centre of mass [kg m^2].",
              forms::moments},
        Field{"axes", &MassProperties::axes,
              "Unit quaternion x, y, z, w that turns the principal axes into the shape's frame."},
    };
  }
};

template <>
struct Record<Part> {
  static constexpr const char* name = "part";
  static constexpr const char* description = "A solid at its place in a compound.";
  static auto fields() {
    return std::tuple{
        Field{"shape", &Part::shape, "The solid."},
        Field{"position", [](auto& part) -> auto& { return part.pose.position; },
              "Of the part in the body's frame [m]."},
        Field{"orientation", [](auto& part) -> auto& { return part.pose.orientation; }, nullptr},
    };
  }
};

template <>
struct Record<Compound> {
  static constexpr const char* name = "compound";
  static constexpr const char* type = "compound";
  static constexpr const char* description =
      "Several solids that move as one. Without parts there is nothing to collide with.";
  static auto fields() {
    return std::tuple{
        Field{"parts", &Compound::parts, "Solids, each at its place in the body's frame."},
        Field{"solid", &Compound::solid,
              "Of the solid that the parts stand for, as of a mesh; unset: those of the parts together.", forms::any,
              Presence::optional},
    };
  }
};

}  // namespace energymargin
