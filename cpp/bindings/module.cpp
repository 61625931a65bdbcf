#include "arguments.hpp"
#include "convert.hpp"

PYBIND11_MODULE(_core, module) {
  module.doc() = "The compiled core of energymargin.";
  energymargin::binding::bind_limit(module);
  energymargin::binding::bind_shapes(module);
  energymargin::binding::bind_body(module);
  energymargin::binding::bind_joint(module);
  energymargin::binding::bind_scene(module);
  energymargin::binding::bind_plan(module);
  energymargin::binding::bind_world(module);
  energymargin::binding::bind_regions(module);
  energymargin::binding::bind_problem(module);
  energymargin::binding::bind_scores(module);
  energymargin::binding::bind_probability(module);
  py::module_ regions = module.attr("regions");
  energymargin::binding::name_refused_arguments(module);
  energymargin::binding::name_refused_arguments(regions);
  py::module_ disturbances = module.attr("disturbances");
  energymargin::binding::name_refused_arguments(disturbances);
}
