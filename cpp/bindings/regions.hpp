#pragma once
// The parts of the binding of regions.

#include "convert.hpp"

namespace energymargin::binding {

//! Ball, Box, Disc, AnnularSector, Swept, HalfSpace, Speed and Tilt.
void bind_primitives(py::module_& module);

}  // namespace energymargin::binding
