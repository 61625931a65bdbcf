#include "value.hpp"

#include <algorithm>
#include <stdexcept>
#include <vector>

namespace energymargin::app {
namespace {

constexpr std::uint64_t largest_count = 1000000000;

// The whole text as a number of type `Number`, by `read` of the standard library; throws std::logic_error if it is
// none.
template <typename Number, typename Read>
Number parse_whole(const std::string& text, const Read& read) {
  std::size_t length = 0;
  const Number number = read(text, &length);
  if (length != text.size()) throw std::invalid_argument("trailing characters");
  return number;
}

double parse_number(const std::string& text) {
  return parse_whole<double>(text,
                             [](const std::string& digits, std::size_t* length) { return std::stod(digits, length); });
}

// Numbers with commas between.
std::vector<double> parse_numbers(const std::string& text) {
  std::vector<double> numbers;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t end = std::min(text.find(',', start), text.size());
    numbers.push_back(parse_number(text.substr(start, end - start)));
    start = end + 1;
  }
  return numbers;
}

}  // namespace

std::uint64_t Value::whole_number() const {
  try {
    if (text.find('-') != std::string::npos) throw std::invalid_argument("negative");
    return parse_whole<std::uint64_t>(
        text, [](const std::string& digits, std::size_t* length) { return std::stoull(digits, length); });
  } catch (const std::logic_error&) {
    reject(option, "'" + text + "'", "a whole number of at least 0");
  }
}

int Value::count() const {
  const std::uint64_t value = whole_number();
  if (value < 1 || value > largest_count) {
    reject(option, "'" + text + "'", "a whole number from 1 to " + std::to_string(largest_count));
  }
  return static_cast<int>(value);
}

double Value::number() const {
  try {
    return parse_number(text);
  } catch (const std::logic_error&) {
    reject(option, "'" + text + "'", "a number");
  }
}

bool Value::yes_or_no() const {
  require_word(option, text, {"yes", "no"}, "");
  return text == "yes";
}

Vector3 Value::axes() const {
  try {
    const std::vector<double> numbers = parse_numbers(text);
    if (numbers.size() == 1) return Vector3::Constant(numbers[0]);
    if (numbers.size() == 3) return {numbers[0], numbers[1], numbers[2]};
  } catch (const std::logic_error&) {
  }
  reject(option, "'" + text + "'", "a number, or three with commas between");
}

ForceWeights Value::force_weights() const {
  try {
    const std::vector<double> w = parse_numbers(text);
    if (w.size() == 5) return {w[0], w[1], w[2], w[3], w[4]};
  } catch (const std::logic_error&) {
  }
  reject(option, "'" + text + "'", "five numbers with commas between");
}

}  // namespace energymargin::app
