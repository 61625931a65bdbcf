//! TypeErrors that name the argument, where pybind11 lists signatures.
#pragma once

#include <pybind11/pybind11.h>

namespace energymargin::binding {

//! From now on a call that a function or method of the module refuses for its arguments raises a TypeError that names
//! the argument, its value and what was expected. Calls that are right cost what they did.
void name_refused_arguments(pybind11::module_& module);

}  // namespace energymargin::binding
