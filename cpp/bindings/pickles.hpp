#pragma once
// Pickles of what has a JSON form. The code of a policy goes with it, pickled as the em.Policy that it is.

#include <memory>
#include <string>

#include "energymargin/problem_io.hpp"
#include "given.hpp"

namespace energymargin::binding {

//! The em.Policy of a plan, or None.
py::object policy_of(const Plan& plan);

//! What Python gives for policies by their names. Throws unless each is an em.Policy.
Policies policies_by_name(const Given<Policies>& policies);

//! JSON, the em.Policy or None, and what else has no JSON form or None.
using Pickled = py::typing::Tuple<py::str, py::object, py::object>;

//! `plan_of(value)` is its plan or null, `read(text, policies)` makes a value of its JSON. `take(value)` takes off
//! what has no JSON form, `give(value, taken)` puts it back.
template <typename Value, typename PlanOf, typename Read, typename Take, typename Give>
auto pickled_as_json(const PlanOf& plan_of, const Read& read, const Take& take, const Give& give) {
  constexpr const char* any_name = "pickled";  // of the policy, in the text
  return py::pickle(
      [=](const Value& value) -> Pickled {
        Value written = value;
        const py::object rest = take(written);
        Plan* const plan = plan_of(written);
        py::object policy = plan ? policy_of(*plan) : py::none();
        if (!policy.is_none()) {
          auto named = std::make_shared<Policy>(*plan->policy);
          named->name = any_name;
          plan->policy = std::move(named);
        }
        return py::make_tuple(to_json(written), policy, rest);
      },
      [=](const Pickled& state) {
        Policies policies;
        if (!state[1].is_none()) policies.emplace(any_name, state[1].cast<Plan>());
        Value value = read(state[0].cast<std::string>(), policies);
        if (!state[2].is_none()) give(value, state[2]);
        return value;
      });
}

//! The same of a value that has a JSON form but for its policy.
template <typename Value, typename PlanOf, typename Read>
auto pickled_as_json(const PlanOf& plan_of, const Read& read) {
  return pickled_as_json<Value>(
      plan_of, read, [](Value&) { return py::object(py::none()); }, [](Value&, const py::object&) {});
}

}  // namespace energymargin::binding
