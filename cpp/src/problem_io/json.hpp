#pragma once
// The JSON of problem files: its text, its names, and its two directions.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "energymargin/plausibility.hpp"
#include "energymargin/problem.hpp"

namespace energymargin::problem_io {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;  //!< keeps its keys in the order in which they were written

inline constexpr const char* format_name = "energymargin-problem";

//! Throws std::invalid_argument that names the line and the place at which the text stops being JSON, and the place of
//! a number beyond all bounds, of a key that is given twice, and of nesting without end.
Json parse(const std::string& text, const std::string& what = "a problem");

//! Mesh files are looked for in `folder`; empty: there is none. `warnings` as in from_json. Throws
//! std::invalid_argument that names the place in the file and what was expected there.
Problem read_problem(const Json& json, const std::string& folder, std::vector<Warning>* warnings = nullptr);

//! Rows are packed.
OrderedJson write(const Plan& plan);

//! A plan alone, which no scene is there for. Throws as `read_problem`.
Plan read_plan(const Json& json);

//! The beginning of a text, for an error message: cut between two of its characters.
inline std::string shortened(std::string text, std::size_t size = 60) {
  if (text.size() <= size) return text;
  size -= 3;
  while (size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0U) == 0x80U) --size;
  return text.substr(0, size) + "...";
}

//! The same in quotes, for any bytes: in one line, and in valid UTF-8.
inline std::string in_quotes(const std::string& text) {
  return Json(shortened(text)).dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace energymargin::problem_io
