#include "schema_check.hpp"

#include <stdexcept>
#include <string>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>
#include <vector>

#include "energymargin/problem_io.hpp"

namespace energymargin::problem_io {
namespace {

using Adapter = valijson::adapters::NlohmannJsonAdapter;

struct Schema : valijson::Schema {
  Schema() {
    const Json json = Json::parse(problem_schema());
    valijson::SchemaParser(valijson::SchemaParser::kDraft7).populateSchema(Adapter(json), *this);
  }
};

// From "<root>", "[scene]", "[bodies]", "[1]", "[mass]" to "scene.bodies[1].mass".
std::string place(const std::vector<std::string>& context) {
  std::string path;
  for (std::size_t i = 1; i < context.size(); ++i) {
    const std::string word = context[i].substr(1, context[i].size() - 2);
    const bool index = word.find_first_not_of("0123456789") == std::string::npos;
    path += index ? context[i] : (path.empty() ? "" : ".") + word;
  }
  return path.empty() ? "problem" : path;
}

}  // namespace

void check_schema(const Json& json) {
  static const Schema schema;
  valijson::Validator validator;
  // To say what is wrong costs more than to see that nothing is.
  if (validator.validate(schema, Adapter(json), nullptr)) return;
  valijson::ValidationResults results;
  validator.validate(schema, Adapter(json), &results);
  valijson::ValidationResults::Error error;
  results.popError(error);  // the first one is the innermost
  throw std::invalid_argument(place(error.context) + " does not fit the schema: " + error.description);
}

}  // namespace energymargin::problem_io
