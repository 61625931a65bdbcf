#include "energymargin/metrics/lower_bound.hpp"

#include <algorithm>

#include "base/check.hpp"
#include "bounds/barrier_bound.hpp"

namespace energymargin {
namespace {

std::string reason_of(const LowerBound& bound, const std::string& of_region, const std::string& of_energy) {
  if (bound.effort > 0.0) return {};
  if (!of_region.empty()) return of_region;
  if (!of_energy.empty()) return of_energy;
  const double available = bound.kinetic + bound.stored;
  if (available <= 0.0) return "there may be a way out on which the energy of the object never rises";
  return "the barrier may be as low as " + text(bound.barrier) + " J, and bodies, springs and joints can give " +
         text(available) + " J";
}

LowerBound bound_of(const Problem& problem, const Region& captured, std::size_t object,
                    const LowerBoundOptions& options) {
  const bounds::Subject subject(problem, object);
  const bounds::AvailableEnergy available = bounds::available_energy(subject);
  const bounds::BarrierBound barrier =
      bounds::barrier_bound(subject, captured, {options.cells, options.tolerance, available.total(), options.limit});
  LowerBound bound;
  bound.barrier = barrier.barrier;
  bound.kinetic = available.kinetic;
  bound.stored = available.stored;
  bound.cells = barrier.cells;
  bound.complete = barrier.complete;
  // A cage holds whatever energy there is.
  bound.effort = std::isinf(barrier.barrier) ? barrier.barrier : std::max(barrier.barrier - available.total(), 0.0);
  bound.reason = reason_of(bound, barrier.reason, available.reason);
  return bound;
}

}  // namespace

void validate(const LowerBoundOptions& options) {
  require_at_least("cells", options.cells, 1);
  require_positive("tolerance", options.tolerance);
}

LowerBound effort_lower_bound(const Problem& problem, const LowerBoundOptions& options) {
  validate(options);
  validate(problem);
  require_disturbed(problem, "effort_lower_bound");
  const Stepping& stepping = problem.scene.stepping();
  if (stepping.simulator || stepping.engine != EngineKind::native) {
    LowerBound none;
    none.reason = "only in the engine 'native' does nothing come through anything, which the proof needs";
    return none;
  }
  const Region& captured = capture_set(problem, options.captured);
  const std::vector<Region> sets = captured_by_object(problem);
  const std::vector<std::size_t> objects = problem.scene.with_role(Role::object);
  std::vector<LowerBound> bounds;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    require_free_object(problem, objects[i], "effort_lower_bound");
    const bool all = options.captured == Captured::all;
    bounds.push_back(bound_of(problem, all && !sets.empty() ? sets[i] : captured, objects[i], options));
  }
  const auto lower = [](const LowerBound& a, const LowerBound& b) { return a.effort < b.effort; };
  // Of all, the first one that leaves is an escape; of any, every one has to.
  const auto deciding = options.captured == Captured::all ? std::min_element(bounds.begin(), bounds.end(), lower)
                                                          : std::max_element(bounds.begin(), bounds.end(), lower);
  return *deciding;
}

}  // namespace energymargin
