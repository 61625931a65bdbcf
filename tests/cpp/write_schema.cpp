// Prints the schema of problem files with the definitions that follow from the code: make schema.

#include <iostream>

#include "energymargin/problem_io.hpp"
#include "schema_definitions.hpp"

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t line_length = 120;

// A list or an object between its brackets, each item after `separator`.
template <typename Layout>
std::string bracketed(const Json& json, const std::string& separator, const std::string& end, const Layout& layout) {
  std::string text;
  for (const auto& [key, value] : json.items()) {
    const std::string name = json.is_object() ? Json(key).dump() + ": " : "";
    text += (text.empty() ? "" : ",") + separator + name + layout(value, name.size());
  }
  return (json.is_object() ? "{" : "[") + text + end + (json.is_object() ? "}" : "]");
}

std::string one_line(const Json& json) {
  if (!json.is_structured() || json.empty()) return json.dump();
  const std::string end = json.is_object() ? " " : "";
  const std::string line = bracketed(json, " ", end, [](const Json& value, std::size_t) { return one_line(value); });
  return json.is_object() ? line : "[" + line.substr(2);
}

// What fits into a line is one line. `taken`: of the first line, by the margin and the name.
std::string layout(const Json& json, const std::string& margin, std::size_t taken) {
  const std::string line = one_line(json);
  if (!json.is_structured() || json.empty() || taken + line.size() + 1 < line_length) return line;
  const std::string deeper = margin + "  ";
  return bracketed(json, "\n" + deeper, "\n" + margin,
                   [&](const Json& value, std::size_t name) { return layout(value, deeper, deeper.size() + name); });
}

}  // namespace

int main() {
  Json schema = Json::parse(energymargin::problem_schema());
  const Json definitions = energymargin::problem_io::schema_definitions();
  for (const auto& [name, definition] : definitions.items()) schema["definitions"][name] = definition;
  std::cout << layout(schema, "", 0) << "\n";
}
