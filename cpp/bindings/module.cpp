#include "arguments.hpp"
#include "door.hpp"

PYBIND11_MODULE(_core, module) {
  module.doc() = "The compiled core of energymargin.";
  energymargin::door::bind_limit(module);
  energymargin::door::bind_scene(module);
  energymargin::door::bind_plan(module);
  energymargin::door::bind_world(module);
  energymargin::door::bind_regions(module);
  energymargin::door::bind_problem(module);
  energymargin::door::bind_scores(module);
  energymargin::door::bind_probability(module);
  py::module_ regions = module.attr("regions");
  energymargin::door::name_refused_arguments(module);
  energymargin::door::name_refused_arguments(regions);
  py::module_ disturbances = module.attr("disturbances");
  energymargin::door::name_refused_arguments(disturbances);
}
