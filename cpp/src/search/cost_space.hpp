#pragma once
// State x cost, eq. 9, and the controls of a search, as OMPL sees them.

#include <ompl/base/StateSpace.h>
#include <ompl/control/spaces/RealVectorControlSpace.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "energymargin/problem.hpp"
#include "energymargin/search/tree.hpp"

namespace energymargin::search {

//! The streams of a search's seed, one for each of what draws from it.
namespace streams {
inline constexpr std::uint64_t planner = 0, states = 1, controls = 2, shortening = 3;
}  // namespace streams

//! How far an object gets in one longest edge: the unit of each kind of coordinate.
struct Scales {
  double position = 1.0;          //!< [m]
  double orientation = 1.0;       //!< [rad]
  double velocity = 1.0;          //!< [m/s]
  double angular_velocity = 1.0;  //!< [rad/s]

  //! From the wrench bounds, the longest edge and the speeds at the start. `object` is an index in the scene.
  Scales(const Problem& problem, std::size_t object);
};

//! The space Z x R+ of the feasible problem P_c, with the objects' parts of z; the whole is in the tree's row `node`.
class CostSpace : public ompl::base::StateSpace {
 public:
  struct Values {
    std::vector<BodyState> objects;  //!< the objects' parts of z
    double cost = 0.0;               //!< effort from the root [J]
    double time = 0.0;               //!< since the root, with a horizon [s]
    int node = -1;                   //!< row of the tree; -1 for a sample
  };
  class StateType : public ompl::base::State, public Values {};

  //! Samples lie around the objects' starts; `seed` is that of the sampler.
  CostSpace(const Problem& problem, std::uint64_t seed);

  //! In the order of the scene's objects.
  const std::vector<BodyState>& starts() const { return starts_; }
  const std::vector<Scales>& scales() const { return scales_; }

  //! The bound c on the cost; inf at first.
  double bound() const { return bound_; }
  void lower_bound(double cost) { bound_ = cost; }

  //! Times are sampled up to here [s]; none without a clock.
  const std::optional<double>& horizon() const { return horizon_; }

  //! The unit of time, a longest edge [s].
  double duration() const { return duration_; }

  //! Root of the sum of the squared differences of an object's coordinates in units of its scales, the squares averaged
  //! over the objects. With a horizon the time counts too; once the bound is finite, so does the cost.
  double distance(const ompl::base::State* a, const ompl::base::State* b) const override;

  unsigned int getDimension() const override {
    return 13 * static_cast<unsigned int>(starts_.size()) + 1 + (horizon_ ? 1 : 0);
  }
  double getMaximumExtent() const override;
  double getMeasure() const override { return 1.0; }
  void enforceBounds(ompl::base::State*) const override {}
  bool satisfiesBounds(const ompl::base::State*) const override { return true; }
  void copyState(ompl::base::State* destination, const ompl::base::State* source) const override;
  bool equalStates(const ompl::base::State* a, const ompl::base::State* b) const override;
  void interpolate(const ompl::base::State* from, const ompl::base::State* to, double t,
                   ompl::base::State* state) const override;
  //! The default has six coordinates an object, so that no motion of one makes up for that of another: its change of
  //! position and of orientation since the start. Then the cost, below a finite bound, and with a horizon the time.
  //! Cells are of size 1. It throws std::domain_error if a coordinate is nan: the state is not finite.
  void registerProjections() override;
  ompl::base::StateSamplerPtr allocDefaultStateSampler() const override;
  ompl::base::State* allocState() const override;
  void freeState(ompl::base::State* state) const override { delete state->as<StateType>(); }

 private:
  std::vector<BodyState> starts_;
  std::vector<Scales> scales_;
  double bound_;
  std::uint64_t seed_;
  std::optional<double> horizon_;
  double duration_;
};

//! The row of the tree in which a state of a CostSpace stands; -1 for a sample.
inline int node_of(const ompl::base::State* state) { return state->as<CostSpace::StateType>()->node; }

//! Rotation vector from one orientation to another, the shorter way [rad].
Vector3 rotation(const BodyState& from, const BodyState& to);

//! A control is a wrench on each object (6 numbers each) and the number of steps that they last.
class WrenchSpace : public ompl::control::RealVectorControlSpace {
 public:
  WrenchSpace(const ompl::base::StateSpacePtr& states, const Problem& problem, std::uint64_t seed,
              Sampling sampling = Sampling::uniform);

  //! What a control says.
  Edge edge(const ompl::control::Control* control) const;

  Sampling sampling() const { return sampling_; }

  //! Steps from a state of a CostSpace to the horizon; none without a clock.
  std::optional<int> steps_left(const ompl::base::State* state) const;

  ompl::control::ControlSamplerPtr allocDefaultControlSampler() const override;

 private:
  std::uint64_t seed_;
  Sampling sampling_;
  double step_;
};

//! OMPL tells errors alone for as long as any of these is there; then its log level is again what it was.
std::shared_ptr<const void> quiet_ompl();

}  // namespace energymargin::search
