//! TypeErrors that name the argument, where pybind11 lists signatures.
#pragma once

#include <pybind11/pybind11.h>

namespace energymargin::binding {

//! Makes the TypeErrors of the module's functions and methods name the argument, its value and what was expected. Calls
//! without an error take no longer.
void name_refused_arguments(pybind11::module_& module);

}  // namespace energymargin::binding
