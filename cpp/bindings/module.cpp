#include "bindings.hpp"

// A class comes before the functions whose signatures name it.
PYBIND11_MODULE(_core, module) {
  using namespace energymargin::binding;
  module.doc() = "The compiled core of energymargin.";
  for (const auto bind : {bind_limit, bind_shapes, bind_body, bind_joint, bind_scene, bind_plan, bind_audit, bind_world,
                          bind_regions, bind_problem, bind_tree, bind_capture, bind_lower_bound, bind_effort,
                          bind_escape_energy, bind_force, bind_batch, bind_disturbances, bind_probability}) {
    bind(module);
  }
}
