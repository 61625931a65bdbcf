#pragma once
// The words for the values of enums, in problem files and in Python.

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "energymargin/problem.hpp"

namespace energymargin {

//! Pairs of a word and its value, for each value of an enum.
template <typename Enum>
struct Words;

template <>
struct Words<Role> {
  static constexpr std::pair<const char*, Role> all[]{
      {"none", Role::none}, {"object", Role::object}, {"effector", Role::effector}};
};

template <>
struct Words<JointType> {
  static constexpr std::pair<const char*, JointType> all[]{
      {"fixed", JointType::fixed}, {"revolute", JointType::revolute}, {"prismatic", JointType::prismatic}};
};

template <>
struct Words<Effector> {
  static constexpr std::pair<const char*, Effector> all[]{{"coast", Effector::coast}, {"drive", Effector::drive}};
};

template <typename Enum>
const char* word_of(Enum value) {
  for (const auto& [word, named] : Words<Enum>::all) {
    if (named == value) return word;
  }
  throw std::logic_error("a value without a word");
}

//! The value that a word stands for, if it stands for one.
template <typename Enum>
std::optional<Enum> value_of(const std::string& text) {
  for (const auto& [word, value] : Words<Enum>::all) {
    if (text == word) return value;
  }
  return std::nullopt;
}

//! All words of an enum in quotes: as 'a' or 'b' with the quote ' and the separator " or ".
template <typename Enum>
std::string list_of_words(const std::string& quote, const std::string& separator) {
  std::string list;
  for (const auto& [word, value] : Words<Enum>::all) list += (list.empty() ? "" : separator) + quote + word + quote;
  return list;
}

}  // namespace energymargin
