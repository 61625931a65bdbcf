#pragma once
// A lower bound of the effort of escape, a class that the effort itself speaks of.

#include <pybind11/pybind11.h>

namespace energymargin::binding {

void bind_lower_bound(pybind11::module_& module);

}  // namespace energymargin::binding
