#pragma once
// The object's configurations as an OMPL state space.

#include <ompl/base/StateSpace.h>

#include "quasistatic/landscape.hpp"

namespace energymargin::quasistatic {

//! Poses of the object. The distance of two is the farthest that any point of the object moves on the way, or a little
//! more: a turn counts by the object's radius, and not at all where it makes no difference.
class PoseSpace : public ompl::base::StateSpace {
 public:
  struct StateType : ompl::base::State {
    Pose pose;
    const PoseSpace* space = nullptr;
  };

  //! `reach` is half the edge of the box around the start that positions are drawn from [m].
  PoseSpace(const Landscape& landscape, double reach);

  double distance(const Pose& from, const Pose& to) const { return landscape_.length(from, to); }

  unsigned int getDimension() const override { return dimension_; }
  double getMaximumExtent() const override { return extent_; }
  double getMeasure() const override { return 1.0; }  // samples are drawn below a bound, in no simple shape
  void enforceBounds(ompl::base::State*) const override {}
  bool satisfiesBounds(const ompl::base::State*) const override { return true; }
  double distance(const ompl::base::State* a, const ompl::base::State* b) const override;
  void copyState(ompl::base::State* destination, const ompl::base::State* source) const override;
  bool equalStates(const ompl::base::State* a, const ompl::base::State* b) const override;
  void interpolate(const ompl::base::State* from, const ompl::base::State* to, double t,
                   ompl::base::State* state) const override;
  ompl::base::StateSamplerPtr allocDefaultStateSampler() const override;
  ompl::base::State* allocState() const override;
  void freeState(ompl::base::State* state) const override { delete state->as<StateType>(); }

 private:
  const Landscape& landscape_;
  unsigned int dimension_;
  double extent_;
};

inline const Pose& pose_of(const ompl::base::State* state) { return state->as<PoseSpace::StateType>()->pose; }
inline Pose& pose_of(ompl::base::State* state) { return state->as<PoseSpace::StateType>()->pose; }

}  // namespace energymargin::quasistatic
