#pragma once
// How a search draws its controls.

namespace energymargin {

enum class Sampling {
  uniform,  //!< wrenches evenly between their bounds (paper, Section V)
  mixed,    //!< nearly half of them so; the others at their bounds, along one axis, none at all, or that of the edge
            //!< before; with a horizon some without a wrench last as long as they like
};

}  // namespace energymargin
