//! How a bound object shows itself at Python's prompt.
#pragma once

#include <pybind11/pybind11.h>

#include <initializer_list>
#include <string>
#include <utility>

namespace energymargin::binding {

//! As Type(name=value, ...), each value as Python shows it.
inline std::string described(const std::string& type,
                             std::initializer_list<std::pair<const char*, pybind11::object>> fields) {
  std::string text;
  for (const auto& [name, value] : fields) {
    text += (text.empty() ? "" : ", ") + std::string(name) + "=" + pybind11::repr(value).cast<std::string>();
  }
  return type + "(" + text + ")";
}

}  // namespace energymargin::binding
