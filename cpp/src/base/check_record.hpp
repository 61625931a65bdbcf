#pragma once
// Validation of structs by the description of their fields.

#include <functional>
#include <optional>

#include "base/angles.hpp"
#include "base/check.hpp"
#include "base/record.hpp"

namespace energymargin {

template <typename Struct>
void require_fields(const Struct& object, const std::string& prefix = "");

inline void require_form(const std::string& name, double value, const Form& form) {
  if (form == forms::positive) {
    require_positive(name, value);
  } else if (form == forms::not_negative) {
    require_not_negative(name, value);
  } else if (form == forms::turn) {
    if (!(std::abs(value) > 0.0 && std::abs(value) <= full_turn)) {
      reject(name, text(value), "an angle of at most 2 pi in size, and not 0");
    }
  } else if (form == forms::half_turn) {
    if (!(value >= 0.0 && value <= pi)) reject(name, text(value), "an angle from 0 to pi");
  } else {
    require_finite(name, value);
  }
}

inline void require_form(const std::string& name, const Vector3& value, const Form& form) {
  if (form == forms::direction) {
    require_unit(name, value);
  } else if (form == forms::sizes) {
    if (!(value.array() > 0.0).all()) reject(name, text(value), "three numbers above 0");
  } else if (form == forms::bounds) {
    for (const double number : value) require_not_negative(name, number);
  } else {
    require_finite(name, value);
  }
}

template <typename Value>
void require_form(const std::string& name, const Value& value, const Form&) {
  if constexpr (std::is_same_v<Value, Vector2>) {
    require_finite(name, Vector3(value.x(), value.y(), 0.0));
  } else if constexpr (is_record<Value>) {
    require_fields(value, name + ": ");
  }
}

template <typename Value>
void require_form(const std::string& name, const std::optional<Value>& value, const Form& form) {
  if (value) require_form(name, *value, form);
}

//! Throws std::invalid_argument if a number is not finite, or not as its field's form wants it. Texts, enums, shapes
//! and regions are what their owners check.
template <typename Struct>
void require_fields(const Struct& object, const std::string& prefix) {
  visit_fields<Struct>(
      [&](const auto& field) { require_form(prefix + field.name, std::invoke(field.get, object), field.form); });
}

}  // namespace energymargin
