#pragma once
// What a planner offers to AO-x besides being a planner.

namespace energymargin::search {

class Prunable {
 public:
  virtual ~Prunable() = default;

  //! Forgets the nodes whose cost is not below `bound`: nothing that grows from them can be better.
  virtual void prune(double bound) = 0;
};

}  // namespace energymargin::search
