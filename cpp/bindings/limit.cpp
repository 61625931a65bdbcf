// Timeouts and cancels for Python.

#include "bindings.hpp"
#include "long_call.hpp"

namespace energymargin::binding {

void bind_limit(py::module_& module) {
  py::register_exception<Cancelled>(module, "Cancelled", PyExc_RuntimeError).attr("__doc__") =
      "A Cancel ended a long call that had no result yet.";
  py::register_exception_translator([](std::exception_ptr error) {
    try {
      if (error) std::rethrow_exception(error);
    } catch (const TimedOut& late) {
      PyErr_SetString(PyExc_TimeoutError, late.what());
    }
  });
  py::class_<Cancel, std::shared_ptr<Cancel>>(
      module, "Cancel", "Ends the long calls that have it as `cancel`, from any thread. It cannot be reset.")
      .def(py::init<>())
      .def(
          "set", [](Cancel& cancel) { cancel.is_set = true; }, "Ends these calls, and all later ones.")
      .def_property_readonly(
          "is_set", [](const Cancel& cancel) { return cancel.is_set.load(); }, "Whether `set` was called.")
      .def("__repr__", [](const Cancel& cancel) {
        return std::string("Cancel(is_set=") + (cancel.is_set ? "True" : "False") + ")";
      });
}

}  // namespace energymargin::binding
