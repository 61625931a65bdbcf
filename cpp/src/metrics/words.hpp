#pragma once
// The words of options, for Python and for the command line.

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/check.hpp"
#include "energymargin/metrics/effort.hpp"
#include "energymargin/problem_io.hpp"

namespace energymargin {

inline const std::vector<std::string> effort_planners{"est", "rrt"};
inline const std::vector<std::string> escape_energy_planners{"bit*", "rrt*"};

template <typename Value>
using Words = std::vector<std::pair<std::string, Value>>;

inline const Words<Search>& words_of(Search) {
  static const Words<Search> words{{"improved", Search::improved}, {"published", Search::published}};
  return words;
}

inline const Words<Sampling>& words_of(Sampling) {
  static const Words<Sampling> words{{"mixed", Sampling::mixed}, {"uniform", Sampling::uniform}};
  return words;
}

inline const Words<Captured>& words_of(Captured) {
  static const Words<Captured> words{{"all", Captured::all}, {"any", Captured::any}};
  return words;
}

inline const Words<Meshes>& words_of(Meshes) {
  static const Words<Meshes> words{{"embedded", Meshes::embedded}, {"files", Meshes::files}};
  return words;
}

//! As "'all' or 'any'", "'captured', 'success' or 'any'".
inline std::string alternatives(const std::vector<std::string>& words, const std::string& quote = "'") {
  std::string text;
  for (const std::string& word : words) {
    if (!text.empty()) text += &word == &words.back() ? " or " : ", ";
    text += quote + word + quote;
  }
  return text;
}

//! The words of an option of this type, in their order.
template <typename Value>
std::vector<std::string> all_words() {
  std::vector<std::string> all;
  for (const auto& [word, value] : words_of(Value())) all.push_back(word);
  return all;
}

//! The value of a word. Throws std::invalid_argument that names the argument, the word and the alternatives.
template <typename Value>
Value value_of(const std::string& argument, const std::string& word, const std::string& quote = "'") {
  for (const auto& [name, value] : words_of(Value())) {
    if (name == word) return value;
  }
  reject(argument, "'" + word + "'", alternatives(all_words<Value>(), quote));
}

template <typename Value>
const std::string& word_of(Value value) {
  for (const auto& [word, meaning] : words_of(value)) {
    if (meaning == value) return word;
  }
  throw std::logic_error("a value without a word");
}

//! Throws std::invalid_argument that names the argument, the word and the alternatives.
inline void require_word(const std::string& argument, const std::string& word, const std::vector<std::string>& words,
                         const std::string& quote = "'") {
  if (std::find(words.begin(), words.end(), word) != words.end()) return;
  reject(argument, "'" + word + "'", alternatives(words, quote));
}

}  // namespace energymargin
