#pragma once
// What the tests expect again and again: equal bits, and a clear refusal.

#include <gtest/gtest.h>

#include <cstring>
#include <initializer_list>
#include <stdexcept>
#include <string>

#include "energymargin/search/tree.hpp"

namespace energymargin {

//! Equal sizes and equal bytes, so that also -0 and 0 differ.
template <typename Matrix>
bool same_bits(const Matrix& a, const Matrix& b) {
  using Scalar = typename Matrix::Scalar;
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         std::memcmp(a.data(), b.data(), sizeof(Scalar) * static_cast<std::size_t>(a.size())) == 0;
}

inline bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof(double)) == 0; }

inline bool same_bits(const Tree& a, const Tree& b) {
  return same_bits(a.states, b.states) && same_bits(a.costs, b.costs) && same_bits(a.parents, b.parents) &&
         same_bits(a.controls, b.controls) && same_bits(a.durations, b.durations);
}

//! The call throws std::invalid_argument, and its message holds each of the parts.
template <typename Call>
testing::AssertionResult rejects(const Call& call, std::initializer_list<std::string> parts) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    const std::string message = error.what();
    for (const std::string& part : parts) {
      if (message.find(part) == std::string::npos) {
        return testing::AssertionFailure() << "\"" << message << "\" does not say \"" << part << "\"";
      }
    }
    return testing::AssertionSuccess();
  } catch (const std::exception& error) {
    return testing::AssertionFailure() << "another type of error: " << error.what();
  }
  return testing::AssertionFailure() << "nothing was rejected";
}

}  // namespace energymargin
