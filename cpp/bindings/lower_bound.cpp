// A lower bound of the effort of escape for Python.

#include "energymargin/metrics/lower_bound.hpp"

#include "bindings.hpp"
#include "long_call.hpp"
#include "problem/words.hpp"
#include "repr.hpp"

namespace energymargin::binding {
namespace {

LowerBound bound_effort(const Problem& problem, const Keywords& keywords) {
  LongCall call(keywords);
  LowerBoundOptions options;
  keywords("cells", options.cells)("tolerance", options.tolerance)("captured", options.captured).end();
  return call.run([&](const Limit& limit) {
    options.limit = limit;
    return effort_lower_bound(problem, options);
  });
}

}  // namespace

void bind_lower_bound(py::module_& module) {
  py::class_<LowerBound> type(module, "LowerBound", "A lower bound of the effort of escape.");
  type.def_readonly("effort", &LowerBound::effort, "No escape takes less [J]; inf: there is none, a cage.")
      .def_property_readonly("cage", &LowerBound::cage, "Whether it is proved that there is no escape.")
      .def_readonly("barrier", &LowerBound::barrier, "Least rise of the object's energy on any way out, or less [J].")
      .def_readonly("kinetic", &LowerBound::kinetic, "Kinetic energy of all bodies at the start [J].")
      .def_readonly("stored", &LowerBound::stored,
                    "Energy that other bodies, springs and joints can release [J]; inf: there is no end of it.")
      .def_readonly("cells", &LowerBound::cells, "Cells of poses that were looked at.")
      .def_readonly("complete", &LowerBound::complete,
                    "Whether the barrier is known to the tolerance, or it is a cage. False: the cells, the timeout or "
                    "the cancel came first, and more cells may give a higher bound.")
      .def_readonly("reason", &LowerBound::reason,
                    "Why the effort is bounded by 0 alone; empty if it is bounded by more.");
  def_repr(type, "LowerBound", {"effort", "barrier", "kinetic", "stored", "cells", "complete", "reason"});
  def_metric(module, "effort_lower_bound", &bound_effort);
}

}  // namespace energymargin::binding
