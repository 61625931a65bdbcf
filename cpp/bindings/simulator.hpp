#pragma once
// Engines of Python: what steps a scene, by a word or as an em.engines.Engine.

#include <memory>

#include "energymargin/simulator.hpp"
#include "given.hpp"
#include "scene/records.hpp"

namespace energymargin::binding {

//! What Python gives for an engine: a word, or else an em.engines.Engine.
struct EngineChoice {
  EngineKind kind = EngineKind::native;
  std::shared_ptr<const Simulator> simulator{};
};

EngineChoice convert(Type<EngineChoice>, const std::string& name, const py::handle& value);

//! The word, or the em.engines.Engine.
py::object engine_of(const Scene& scene);

}  // namespace energymargin::binding

namespace pybind11::detail {

constexpr auto name_of_given(energymargin::Type<energymargin::binding::EngineChoice>) {
  return const_name("typing.Any");
}

}  // namespace pybind11::detail
