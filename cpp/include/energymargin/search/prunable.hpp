#pragma once
// A planner that drops what AO-x no longer needs.

namespace energymargin::search {

class Prunable {
 public:
  virtual ~Prunable() = default;

  //! Forgets the nodes whose cost is not below `bound`: nothing that grows from them can be better.
  virtual void prune(double bound) = 0;
};

}  // namespace energymargin::search
