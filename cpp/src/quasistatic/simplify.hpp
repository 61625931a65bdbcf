#pragma once
// Leaves out what a path does not need.

#include "quasistatic/landscape.hpp"
#include "quasistatic/path.hpp"

namespace energymargin::quasistatic {

//! The path up to where it leaves the capture set.
Path cut(const Path& path, Landscape& landscape);

//! The path without the poses that it can do without: its barrier is no higher.
Path straighten(const Path& path, Landscape& landscape);

//! What sliding along a support would be, without turns if that leads out; `path` itself if nothing simpler does. No
//! pose is farther than `reach` [m] from the start along an axis of the world.
Path simplify(const Path& path, double reach, Landscape& landscape);

}  // namespace energymargin::quasistatic
