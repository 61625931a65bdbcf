#pragma once
// Users' functions in C++ objects. Any thread may copy, call and drop them, and Python's garbage collector sees them:
// an agent whose problem asks the agent is freed with it.
//
// The collector has to know each reference that an object holds. So what Python owns shares its functions with nothing
// else (`Owner`), and while a computation shares them they count as held by others.

#include <memory>
#include <utility>

#include "energymargin/plan.hpp"
#include "energymargin/problem.hpp"
#include "given.hpp"

namespace energymargin::binding {

//! A user's function, which copies share.
class Callback {
 public:
  explicit Callback(py::object function)
      : function_(new py::object(std::move(function)), [](py::object* last) {
          const WithGil acquire;
          delete last;
        }) {}

  const py::object& function() const { return *function_; }
  bool is_shared() const { return function_.use_count() > 1; }

  //! One of the same function that no other shares.
  Callback unshared() const { return Callback(*function_); }

  //! Only of what nobody can reach any more.
  void drop() const { const py::object dropped = std::exchange(*function_, py::none()); }

 private:
  std::shared_ptr<py::object> function_;
};

//! A region's predicate in Python.
struct AskedPredicate {
  Callback function;
  Mask operator()(const States& states) const;
};

//! A policy in Python: a function of (time, number, observations, seeds, memory), which returns (actions, memory).
struct AskedPolicy {
  Callback function;
  bool operator()(const PolicyQuestion& asked, States& memory, States& actions) const;
};

//! Calls `visit(callback)` for the functions that no other object shares.
template <typename Visit>
void visit_functions(const Region& region, const Visit& visit) {
  if (region.is_shared()) return;
  const auto of_expression = [&](const auto& expression) {
    using Expression = std::decay_t<decltype(expression)>;
    if constexpr (std::is_same_v<Expression, regions::Predicate>) {
      const auto* asked = expression.contains.template target<AskedPredicate>();
      if (asked && !asked->function.is_shared()) visit(asked->function);
    } else if constexpr (is_of_regions<Expression>) {
      for (const Region& part : expression.of) visit_functions(part, visit);
    }
  };
  std::visit(of_expression, region.expression());
}

//! `owners`: how many share the policy without being another object.
template <typename Visit>
void visit_functions(const Plan& plan, const Visit& visit, long owners = 1) {
  if (!plan.policy || plan.policy.use_count() > owners) return;
  const auto* asked = plan.policy->act.target<AskedPolicy>();
  if (asked && !asked->function.is_shared()) visit(asked->function);
}

template <typename Visit>
void visit_functions(const Problem& problem, const Visit& visit) {
  visit_functions(problem.captured, visit);
  for (const auto* set : {&problem.succeeded, &problem.captured_any, &problem.succeeded_any, &problem.within}) {
    if (*set) visit_functions(**set, visit);
  }
  if (problem.plan) visit_functions(*problem.plan, visit);
}

// Makes what they hold theirs alone.
void unshare(Region& region);
void unshare(Plan& plan);
void unshare(Problem& problem);

//! Holds what Python owns.
template <typename Value>
struct Owner : std::unique_ptr<Value> {
  explicit Owner(Value* value) : std::unique_ptr<Value>(value) { unshare(*value); }
};

//! Shows the collector what the objects of a class hold.
template <typename Value>
py::custom_type_setup collected() {
  return py::custom_type_setup([](PyHeapTypeObject* heap) {
    PyTypeObject& type = heap->ht_type;
    type.tp_flags |= Py_TPFLAGS_HAVE_GC;
    type.tp_traverse = [](PyObject* self, visitproc visit, void* arg) {  // as Py_VISIT calls them
      Py_VISIT(Py_TYPE(self));
      int found = 0;
      const auto one = [&](const Callback& callback) {
        if (found == 0) found = visit(callback.function().ptr(), arg);
      };
      if (py::detail::is_holder_constructed(self)) visit_functions(py::cast<const Value&>(py::handle(self)), one);
      return found;
    };
    type.tp_clear = [](PyObject* self) {
      const auto drop = [](const Callback& callback) { callback.drop(); };
      if (py::detail::is_holder_constructed(self)) visit_functions(py::cast<const Value&>(py::handle(self)), drop);
      return 0;
    };
  });
}

}  // namespace energymargin::binding

namespace pybind11::detail {

template <typename Value>
struct is_holder_type<Value, energymargin::binding::Owner<Value>> : std::true_type {};

}  // namespace pybind11::detail
