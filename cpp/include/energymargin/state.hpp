#pragma once
// The layout of a state vector: which numbers belong to which body. pack / unpack.
//
// Every body that is not fixed has 13 numbers, in the scene's order: position 3, quaternion 4 (x, y, z, w),
// velocity 3, angular velocity 3.

#include <map>
#include <string>
#include <vector>

#include "energymargin/scene.hpp"
#include "energymargin/types.hpp"

namespace energymargin {

class StateLayout {
 public:
  static constexpr int numbers_per_body = 13;

  explicit StateLayout(const Scene& scene);

  int dimension() const { return dimension_; }

  //! First number of a body by its index in the scene; -1 for a fixed body.
  int offset(std::size_t body) const { return offsets_[body]; }

  //! Reads a body's numbers from a state that starts at `numbers`.
  static BodyState read(const double* numbers);
  static void write(const BodyState& body, double* numbers);

 private:
  std::vector<int> offsets_;
  int dimension_ = 0;
};

//! The state vector of a scene; bodies that are left out have the scene's own values.
State pack(const Scene& scene, const std::map<std::string, BodyState>& bodies = {});

//! The moving bodies' states, by name.
std::map<std::string, BodyState> unpack(const Scene& scene, const State& state);

//! Throws std::invalid_argument unless `state` has the scene's dimension, is finite, has unit quaternions and no
//! velocity along locked axes. `name` is what the error calls it.
void validate(const Scene& scene, const State& state, const std::string& name = "state");

//! The checks of one body's state.
void validate(const Body& body, const BodyState& state, const std::string& name);

}  // namespace energymargin
