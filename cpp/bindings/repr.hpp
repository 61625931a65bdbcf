//! How a bound object shows itself at Python's prompt.
#pragma once

#include <pybind11/pybind11.h>

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace energymargin::binding {

//! As Type(name=value, ...), each value as Python shows it.
template <typename Fields = std::initializer_list<std::pair<const char*, pybind11::object>>>
std::string repr_of_fields(const std::string& type, const Fields& fields) {
  std::string text;
  for (const auto& [name, value] : fields) {
    text += (text.empty() ? "" : ", ") + std::string(name) + "=" + pybind11::repr(value).template cast<std::string>();
  }
  return type + "(" + text + ")";
}

//! __repr__ as title(attribute=value, ...).
template <typename Class>
void def_repr(Class& type, const char* title, const std::vector<const char*>& attributes) {
  type.def("__repr__", [title, attributes](const pybind11::object& self) {
    std::vector<std::pair<const char*, pybind11::object>> fields;
    for (const char* name : attributes) fields.emplace_back(name, self.attr(name));
    return repr_of_fields(title, fields);
  });
}

}  // namespace energymargin::binding
