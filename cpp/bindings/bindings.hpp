#pragma once
// What each file of this folder adds to the module.

#include <pybind11/pybind11.h>

#include "energymargin/scene.hpp"

namespace energymargin::binding {

void bind_limit(pybind11::module_& module);
void bind_shapes(pybind11::module_& module);
void bind_body(pybind11::module_& module);
void bind_joint(pybind11::module_& module);
void bind_scene(pybind11::module_& module);
void bind_add_body(pybind11::class_<Scene>& scene);   // and add_plane
void bind_add_joint(pybind11::class_<Scene>& scene);  // and add_spring
void bind_state(pybind11::class_<Scene>& scene);      // pack, unpack, and where a state has which number
void bind_plan(pybind11::module_& module);
void bind_world(pybind11::module_& module);
void bind_audit(pybind11::module_& module);
void bind_regions(pybind11::module_& module);
void bind_problem(pybind11::module_& module);
void bind_tree(pybind11::module_& module);
void bind_capture(pybind11::module_& module);
void bind_lower_bound(pybind11::module_& module);
void bind_effort(pybind11::module_& module);
void bind_escape_energy(pybind11::module_& module);
void bind_force(pybind11::module_& module);
void bind_batch(pybind11::module_& module);
void bind_disturbances(pybind11::module_& module);
void bind_probability(pybind11::module_& module);

}  // namespace energymargin::binding
