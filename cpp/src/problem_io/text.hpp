#pragma once
// Pieces of a file in error messages: in one line, not too long, and in valid UTF-8.

#include <string>

#include "problem_io/json.hpp"

namespace energymargin::problem_io {

//! The beginning of a text, cut between two of its characters.
inline std::string shortened(std::string text, std::size_t size = 60) {
  if (text.size() <= size) return text;
  size -= 3;
  while (size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0U) == 0x80U) --size;
  return text.substr(0, size) + "...";
}

//! The same in quotes, for any bytes.
inline std::string in_quotes(const std::string& text) {
  return Json(shortened(text)).dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace energymargin::problem_io
