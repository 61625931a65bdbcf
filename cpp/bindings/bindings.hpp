#pragma once
// What each file of this folder adds to the module.

#include <pybind11/pybind11.h>

#include "energymargin/scene.hpp"

namespace energymargin::binding {

using Bind = void(pybind11::module_& module);
Bind bind_shapes, bind_body, bind_joint, bind_scene, bind_plan, bind_world, bind_regions, bind_problem, bind_capture,
    bind_effort, bind_escape_energy, bind_force, bind_batch, bind_disturbances, bind_probability;

using BindToScene = void(pybind11::class_<Scene>& scene);
BindToScene bind_add_body;   // and add_plane
BindToScene bind_add_joint;  // and add_spring
BindToScene bind_state;      // pack, unpack, and where a state has which number

}  // namespace energymargin::binding
