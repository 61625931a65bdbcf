#include "quasistatic/pose_space.hpp"

#include <ompl/util/Exception.h>

#include "base/angles.hpp"

namespace energymargin::quasistatic {
namespace {

constexpr double half_turn = pi;

unsigned int turns(Turning turning) {
  if (turning == Turning::none) return 0;
  return turning == Turning::about_axis ? 1 : 3;
}

}  // namespace

PoseSpace::PoseSpace(const Landscape& landscape, double reach)
    : landscape_(landscape),
      dimension_(static_cast<unsigned int>(landscape.sliding().sum()) + turns(landscape.turning())),
      extent_(2.0 * reach * std::sqrt(landscape.sliding().sum()) +
              (landscape.turning() == Turning::none ? 0.0 : half_turn * landscape.radius())) {
  setName("Pose");
}

double PoseSpace::distance(const ompl::base::State* a, const ompl::base::State* b) const {
  return distance(pose_of(a), pose_of(b));
}

void PoseSpace::copyState(ompl::base::State* destination, const ompl::base::State* source) const {
  pose_of(destination) = pose_of(source);
}

bool PoseSpace::equalStates(const ompl::base::State* a, const ompl::base::State* b) const {
  return pose_of(a).position == pose_of(b).position &&
         pose_of(a).orientation.coeffs() == pose_of(b).orientation.coeffs();
}

void PoseSpace::interpolate(const ompl::base::State* from, const ompl::base::State* to, double t,
                            ompl::base::State* state) const {
  pose_of(state) = quasistatic::interpolate(pose_of(from), pose_of(to), t);
}

ompl::base::StateSamplerPtr PoseSpace::allocDefaultStateSampler() const {
  throw ompl::Exception("PoseSpace", "its states are drawn by the problem");
}

ompl::base::State* PoseSpace::allocState() const {
  auto* state = new StateType;
  state->space = this;
  return state;
}

}  // namespace energymargin::quasistatic
