#pragma once
// Words for the values of enums: in problem files, in Python and on the command line.

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/check.hpp"

namespace energymargin {

//! `all` has a word and its value for each value of an enum. The rooms of the enums specialize it in their words.hpp.
template <typename Enum>
struct Words;

template <typename Enum>
const char* word_of(Enum value) {
  for (const auto& [word, enum_value] : Words<Enum>::all) {
    if (enum_value == value) return word;
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

//! All words of an enum, in their order.
template <typename Enum>
std::vector<std::string> all_words() {
  std::vector<std::string> all;
  for (const auto& [word, value] : Words<Enum>::all) all.push_back(word);
  return all;
}

//! As 'captured', 'success' or 'any', with the quote ' and the last separator " or ".
inline std::string alternatives(const std::vector<std::string>& words, const std::string& quote = "'",
                                const std::string& last = " or ") {
  std::string text;
  for (const std::string& word : words) {
    if (!text.empty()) text += &word == &words.back() ? last : ", ";
    text += quote + word + quote;
  }
  return text;
}

//! Throws std::invalid_argument that names the argument, the word and the alternatives.
inline void require_word(const std::string& argument, const std::string& word, const std::vector<std::string>& words,
                         const std::string& quote = "'") {
  if (std::find(words.begin(), words.end(), word) != words.end()) return;
  reject(argument, "'" + word + "'", alternatives(words, quote));
}

//! The value of a word; throws as require_word does.
template <typename Enum>
Enum value_of(const std::string& argument, const std::string& word, const std::string& quote = "'") {
  require_word(argument, word, all_words<Enum>(), quote);
  return *value_of<Enum>(word);
}

}  // namespace energymargin
