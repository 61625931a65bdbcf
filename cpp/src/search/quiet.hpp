#pragma once
// OMPL without its chatter.

#include <memory>

namespace energymargin::search {

//! OMPL tells errors alone for as long as any of these is there; then its log level is again what it was.
std::shared_ptr<const void> quiet_ompl();

}  // namespace energymargin::search
