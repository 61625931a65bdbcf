#pragma once
// The text behind an option of the command line, read as what the option takes.

#include <cstdint>
#include <string>

#include "energymargin/types.hpp"
#include "metrics/words.hpp"
#include "problem/records.hpp"
#include "problem_io/mesh.hpp"

namespace energymargin::app {

//! Each reading throws std::invalid_argument that names the option, its text and what was expected.
struct Value {
  std::string option;
  std::string text;

  std::uint64_t whole_number() const;
  int count() const;
  double number() const;
  bool yes_or_no() const;

  //! One number for all axes, or three with commas between.
  Vector3 axes() const;

  //! Five numbers with commas between.
  ForceWeights force_weights() const;

  //! The value of a word, as the library knows it.
  template <typename Choice>
  Choice choice() const {
    return value_of<Choice>(option, text, "");
  }
};

}  // namespace energymargin::app
