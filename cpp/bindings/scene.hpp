#pragma once
// The parts of Scene's binding.

#include "convert.hpp"

namespace energymargin::binding {

//! add_plane and add_body.
void bind_add_body(py::class_<Scene>& scene);

//! add_joint and add_spring.
void bind_add_joint(py::class_<Scene>& scene);

//! pack, unpack, and where a state has which number.
void bind_state(py::class_<Scene>& scene);

}  // namespace energymargin::binding
