#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <vector>

#include "problem_io/json.hpp"

namespace energymargin::problem_io {
namespace {

// Far more than a problem needs, and far less than a stack holds.
constexpr std::size_t most_depth = 256;

constexpr int number_overflow = 406;  // of nlohmann's errors

// Takes what the parser finds, in the file's order, and knows at each moment where in the file it is.
class Builder : public Json::json_sax_t {
 public:
  explicit Builder(const std::string& text) : text_(text) {}

  Json take() { return std::move(root_); }

  bool null() override { return add(nullptr); }
  bool boolean(bool value) override { return add(value); }
  bool number_integer(number_integer_t value) override { return add(value); }
  bool number_unsigned(number_unsigned_t value) override { return add(value); }
  bool number_float(number_float_t value, const string_t&) override { return add(value); }
  bool string(string_t& value) override { return add(std::move(value)); }
  bool binary(binary_t& value) override { return add(std::move(value)); }
  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& key) override {
    open_.back().key = key;
    if (open_.back().json->contains(key)) throw std::invalid_argument(place() + " is given twice, expected once");
    return true;
  }

  bool parse_error(std::size_t position, const std::string& token, const Json::exception& error) override {
    if (error.id == number_overflow) {
      throw std::invalid_argument(place() + " is " + shortened(token) +
                                  ", expected a number of at most 1.8e308 in size");
    }
    const std::string near = open_.empty() ? "" : ", near " + place();
    if (position > text_.size()) throw std::invalid_argument("cut off at the end of " + line(text_.size()) + near);
    const std::size_t at = std::max<std::size_t>(position, 1);
    throw std::invalid_argument("not valid JSON at " + line(at) + ", column " + std::to_string(at - line_start(at)) +
                                near + ": " + around(at));
  }

 private:
  struct Open {
    Json* json;
    std::string key;  // of an object, the last one
  };

  Json* put(Json value) {
    if (open_.empty()) return &(root_ = std::move(value));
    Json& parent = *open_.back().json;
    if (parent.is_object()) return &(parent[open_.back().key] = std::move(value));
    parent.push_back(std::move(value));
    return &parent.back();
  }
  bool add(Json value) {
    put(std::move(value));
    return true;
  }
  bool open(Json value) {
    if (open_.size() == most_depth) {
      throw std::invalid_argument(shortened(place(), 60) + " has more than " + std::to_string(most_depth) +
                                  " levels of lists and objects");
    }
    open_.push_back({put(std::move(value)), {}});
    return true;
  }
  bool close() {
    open_.pop_back();
    return true;
  }

  // A position counts from 1.
  std::string line(std::size_t position) const {
    const auto end = text_.begin() + static_cast<std::ptrdiff_t>(position - 1);
    return "line " + std::to_string(std::count(text_.begin(), end, '\n') + 1);
  }
  std::size_t line_start(std::size_t position) const {
    return position < 2 ? 0 : text_.rfind('\n', position - 2) + 1;  // npos + 1 is 0
  }
  std::string around(std::size_t position) const {
    std::size_t start = std::max(line_start(position), position - std::min<std::size_t>(position, 20));
    start = std::min(text_.find_first_not_of(" \t", start), position - 1);
    const std::size_t end = std::min({text_.find('\n', position - 1), position + 20, text_.size()});
    return in_single_quotes(text_.substr(start, std::max(start, end) - start));
  }
  // JSON is full of double quotes.
  static std::string in_single_quotes(const std::string& text) {
    const std::string quoted = in_quotes(text);
    std::string plain = "'";
    for (std::size_t i = 1; i + 1 < quoted.size(); ++i) {
      if (quoted[i] != '\\' || quoted[i + 1] != '"') plain += quoted[i];
    }
    return plain + "'";
  }

  // "scene.bodies[1].mass": of what is being read.
  std::string place() const {
    std::string path;
    for (const Open& open : open_) {
      if (open.json->is_array()) {
        const bool begun = &open != &open_.back();  // the item has its place in the list already
        path += "[" + std::to_string(open.json->size() - (begun ? 1 : 0)) + "]";
      } else if (!open.key.empty()) {
        path += (path.empty() ? "" : ".") + word(open.key);
      }
    }
    return path.empty() ? "problem" : shortened(path, 200);
  }
  static std::string word(const std::string& key) {
    const bool plain = std::all_of(key.begin(), key.end(),
                                   [](unsigned char c) { return c < 0x80 && (std::isalnum(c) != 0 || c == '_'); });
    return plain ? shortened(key) : in_quotes(key);
  }

  const std::string& text_;
  Json root_;
  std::vector<Open> open_;
};

}  // namespace

Json parse(const std::string& text, const std::string& what) {
  if (text.find_first_not_of(" \t\r\n") == std::string::npos)
    throw std::invalid_argument("it is empty, expected the JSON of " + what);
  Builder builder(text);
  Json::sax_parse(text, &builder);
  return builder.take();
}

}  // namespace energymargin::problem_io
