#include "json_mutator.hpp"

#include <array>
#include <cstring>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "problem_io/json.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

namespace energymargin::fuzz {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t packed_row = 64;  // characters of a plan's row of six numbers
constexpr int deepest = 100;            // levels that are looked into

// Limits of types, of formats and of what bodies can be.
constexpr std::array<double, 26> numbers{
    0.0,  -0.0, 1.0,   -1.0,  2.0,   0.5,   1e-3,       1e-7,          1e-20,        1e-160, 5e-324, 1e3,    1e7,
    1e10, 1e20, 1e100, 1e155, 1e200, 1e308, 2147483647, -2147483648.0, 4294967296.0, 9.3e18, 1.9e19, 3.1416, -1e308};

class Mutator {
 public:
  explicit Mutator(unsigned seed) : random_(seed) {}

  bool one_in(std::size_t count) { return below(count) == 0; }

  void mutate(Json& json) {
    std::vector<Json*> values;
    collect(json, values, 0);
    Json& value = *values[below(values.size())];
    const Json other = *values[below(values.size())];
    if (one_in(8)) {
      value = other;
    } else if (value.is_number()) {
      value = number(value.get<double>());
    } else if (value.is_string()) {
      value = one_in(3) ? damaged(value.get<std::string>()) : text(values);
    } else if (value.is_structured() && !value.empty()) {
      change_items(value, other);
    } else {
      value = one_in(2) ? Json(true) : other;
    }
  }

 private:
  std::size_t below(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(random_); }

  static void collect(Json& json, std::vector<Json*>& values, int depth) {
    values.push_back(&json);
    if (!json.is_structured() || depth == deepest) return;
    for (Json& item : json) collect(item, values, depth + 1);
  }

  Json number(double value) {
    switch (below(6)) {
      case 0:
        return numbers[below(numbers.size())];
      case 1:
        return static_cast<int>(below(9)) - 3;
      case 2:
        return -value;
      case 3:
        return value * (one_in(2) ? 10.0 : 0.1);
      case 4:
        return value * (1.0 + 1e-7 * static_cast<double>(below(20)));
      default:
        return value + 0.01 * (static_cast<double>(below(20)) - 10.0);
    }
  }

  // Another text of the same file: a name, a type, a role.
  Json text(const std::vector<Json*>& values) {
    std::vector<std::string> texts{"", "inf", "-inf"};
    for (const Json* value : values) {
      if (value->is_string()) texts.push_back(value->get<std::string>());
    }
    return texts[below(texts.size())];
  }

  // Packed rows with another number, or with a row's length more or less.
  Json damaged(std::string text) {
    if (text.empty()) return text;
    const std::size_t at = below(text.size());
    if (one_in(2)) {
      text[at] = text[below(text.size())];
    } else if (one_in(2)) {
      text.erase(at, packed_row);
    } else {
      text.insert(at, text.substr(at, packed_row));
    }
    return text;
  }

  void change_items(Json& value, const Json& other) {
    const auto at = std::next(value.begin(), static_cast<std::ptrdiff_t>(below(value.size())));
    const Json item = *at;
    if (one_in(2)) {
      value.erase(at);
    } else if (value.is_array()) {
      value.push_back(one_in(3) ? other : item);
    } else {
      value[other.is_string() ? other.get<std::string>() : "type"] = item;
    }
  }

  std::minstd_rand random_;
};

}  // namespace

std::size_t mutate_json(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  Mutator mutator(seed);
  Json json = Json::parse(data, data + size, nullptr, false);
  if (json.is_discarded() || mutator.one_in(10)) return LLVMFuzzerMutate(data, size, most);
  do {
    mutator.mutate(json);
  } while (!mutator.one_in(2));
  const std::string text = json.dump();
  if (text.size() > most) return LLVMFuzzerMutate(data, size, most);
  std::memcpy(data, text.data(), text.size());
  return text.size();
}

}  // namespace energymargin::fuzz
