// Prints the schema of problem files with the definitions that follow from the code: make schema.

#include <iostream>

#include "energymargin/problem_io.hpp"
#include "problem_io/schema_definitions.hpp"

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t line_length = 120;

// What fits into one line is one line.
std::string layout(const Json& json, const std::string& margin, std::size_t taken) {
  const std::string line = json.dump(-1);
  if (!json.is_structured() || json.empty() || margin.size() + taken + line.size() + 3 < line_length) return line;
  std::string text;
  for (const auto& [key, value] : json.items()) {
    const std::string name = json.is_object() ? Json(key).dump() + ": " : "";
    text += (text.empty() ? "\n  " : ",\n  ") + margin + name + layout(value, margin + "  ", name.size());
  }
  return (json.is_object() ? "{" : "[") + text + "\n" + margin + (json.is_object() ? "}" : "]");
}

}  // namespace

int main() {
  Json schema = Json::parse(energymargin::problem_schema());
  const Json definitions = energymargin::problem_io::schema_definitions();
  for (const auto& [name, definition] : definitions.items()) schema["definitions"][name] = definition;
  std::cout << layout(schema, "", 0) << "\n";
}
