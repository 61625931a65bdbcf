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

//! What stubs call it.
constexpr auto name_of_given(Type<EngineChoice>) { return pybind11::detail::const_name("typing.Any"); }

}  // namespace energymargin::binding
