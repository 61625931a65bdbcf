#include "problem_io/packed.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string_view>

namespace energymargin::problem_io {
namespace {

constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::size_t bytes_of_number = 8;

std::string bytes_of(const Wrenches& rows) {
  std::string bytes;
  bytes.reserve(bytes_of_number * static_cast<std::size_t>(rows.size()));
  for (Eigen::Index i = 0; i < rows.size(); ++i) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, rows.data() + i, sizeof bits);
    for (std::size_t byte = 0; byte < bytes_of_number; ++byte) bytes += static_cast<char>(bits >> (8 * byte) & 0xFFU);
  }
  return bytes;
}

double number_of(std::string_view bytes) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < bytes_of_number; ++i) {
    bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[i])) << (8 * i);
  }
  double value = 0.0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

// Three bytes, or the last ones, are four digits; "=" stands for those that are not there.
std::string encoded(std::string_view bytes) {
  std::string text;
  text.reserve(4 * (bytes.size() / 3 + 1));
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t j = 0; j < 3; ++j) bits = bits << 8 | (j < count ? static_cast<unsigned char>(bytes[i + j]) : 0U);
    for (std::size_t j = 0; j < 4; ++j) text += j <= count ? digits[bits >> (18 - 6 * j) & 0x3FU] : '=';
  }
  return text;
}

// One text alone stands for the bytes: no blanks, all of the "=", and no bits that nobody reads.
std::string decoded(const std::string& text) {
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3);
  std::uint32_t bits = 0;
  int count = 0;  // of the bits that are no byte yet
  const std::size_t end = std::min(text.find('='), text.size());
  for (std::size_t i = 0; i < end; ++i) {
    const std::size_t digit = digits.find(text[i]);
    if (digit == std::string_view::npos) throw std::invalid_argument("only digits of base64");
    bits = (bits << 6 | static_cast<std::uint32_t>(digit)) & 0xFFFU;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xFFU);
  }
  if (encoded(bytes) != text) throw std::invalid_argument("base64 as this library writes it, with its \"=\"");
  return bytes;
}

}  // namespace

std::string pack(const Wrenches& rows) { return encoded(bytes_of(rows)); }

Wrenches unpack(const std::string& text, int columns) {
  const std::string bytes = decoded(text);
  const std::size_t row = bytes_of_number * static_cast<std::size_t>(columns);
  if (bytes.empty() || bytes.size() % row != 0) {
    throw std::invalid_argument("rows of " + std::to_string(columns) + " numbers, " + std::to_string(row) +
                                " bytes each, and at least one; these are " + std::to_string(bytes.size()) + " bytes");
  }
  Wrenches rows(static_cast<Eigen::Index>(bytes.size() / row), columns);
  for (Eigen::Index i = 0; i < rows.size(); ++i) {
    rows.data()[i] = number_of(std::string_view(bytes).substr(bytes_of_number * static_cast<std::size_t>(i)));
  }
  return rows;
}

}  // namespace energymargin::problem_io
