#pragma once
// Keyword arguments of Python that fill a struct's members. Each keyword is described once: its name and its member.
// From the member come the type in Python, the conversion and the default.

#include <tuple>

#include "argument.hpp"

namespace energymargin::binding {

//! A keyword that has no default.
template <typename Struct, typename Value>
struct RequiredKeyword {
  using Input = typename Argument<Value>::Input;
  const char* name;
  Value Struct::* member;

  void fill(Struct& target, const Input& input) const { target.*member = Argument<Value>::of(name, input); }
  py::arg argument() const { return py::arg(name); }
};

//! A keyword whose default is that of the struct.
template <typename Struct, typename Value>
struct Keyword : RequiredKeyword<Struct, Value> {
  py::arg_v argument() const { return py::arg(this->name) = Argument<Value>::python(Struct{}.*this->member); }
};

template <typename Struct, typename Value>
RequiredKeyword<Struct, Value> required(const char* name, Value Struct::* member) {
  return {name, member};
}

template <typename Struct, typename Value>
Keyword<Struct, Value> keyword(const char* name, Value Struct::* member) {
  return {{name, member}};
}

//! Fills a struct's members with what Python gives for the keywords.
template <typename Struct, typename... Keywords>
void fill(Struct& target, const std::tuple<Keywords...>& keywords, const typename Keywords::Input&... input) {
  std::apply([&](const Keywords&... keyword) { (keyword.fill(target, input), ...); }, keywords);
}

//! Calls `define` with the py::arg of all keywords; those of `named` are given by name alone.
template <typename Define, typename... Positional, typename... Named>
void define_with(const Define& define, const std::tuple<Positional...>& positional, const std::tuple<Named...>& named) {
  std::apply(
      [&](const Positional&... by_position) {
        if constexpr (sizeof...(Named) == 0) {
          define(by_position.argument()...);
        } else {
          std::apply(
              [&](const Named&... by_name) { define(by_position.argument()..., py::kw_only(), by_name.argument()...); },
              named);
        }
      },
      positional);
}

//! A constructor: the keywords fill an `Arguments`, of which `make` makes the object.
template <typename Arguments, typename Class, typename Make, typename... Positional, typename... Named>
void def_constructor(Class& type, const Make& make, const char* doc, const std::tuple<Positional...>& positional,
                     const std::tuple<Named...>& named) {
  const auto construct = [=](const typename Positional::Input&... by_position,
                             const typename Named::Input&... by_name) {
    Arguments arguments{};
    fill(arguments, positional, by_position...);
    fill(arguments, named, by_name...);
    return make(arguments);
  };
  define_with([&](const auto&... extra) { type.def(py::init(construct), extra..., doc); }, positional, named);
}

//! The constructor of a struct whose members the keywords fill.
template <typename Struct, typename... Positional, typename... Named>
void def_members_constructor(py::class_<Struct>& type, const char* doc, const std::tuple<Positional...>& positional,
                             const std::tuple<Named...>& named = {}) {
  def_constructor<Struct>(type, [](const Struct& value) { return value; }, doc, positional, named);
}

//! A function of a problem and of an `Arguments` that the keywords fill, by name alone. energymargin/scores.py, whose
//! users call it through that, says what they are for.
template <typename Result, typename Arguments, typename... Keywords>
void def_metric(py::module_& module, const char* name, Result (*metric)(const Problem&, const Arguments&),
                const std::tuple<Keywords...>& keywords) {
  const auto call = [=](const Given<Problem>& problem, const typename Keywords::Input&... input) {
    const auto& question = given_object("problem", problem);
    Arguments arguments{};
    fill(arguments, keywords, input...);
    return metric(question, arguments);
  };
  std::apply(
      [&](const Keywords&... keyword) {
        module.def(name, call, py::arg("problem"), py::kw_only(), keyword.argument()...);
      },
      keywords);
}

}  // namespace energymargin::binding
