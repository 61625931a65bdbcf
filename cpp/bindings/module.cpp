#include "energymargin/problem_io.hpp"
#include "long_call.hpp"

namespace energymargin::binding {
namespace {

void bind_limit(py::module_& module) {
  py::register_exception<Cancelled>(module, "Cancelled", PyExc_RuntimeError).attr("__doc__") =
      "A Cancel ended a long call that had no result yet.";
  py::register_exception_translator([](std::exception_ptr error) {
    try {
      if (error) std::rethrow_exception(error);
    } catch (const TimedOut& late) {
      PyErr_SetString(PyExc_TimeoutError, late.what());
    } catch (const FileError& failure) {
      py::set_error(PyExc_OSError, failure.what());
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

// What pybind11 would give the methods of an object that was made without __init__: memory that nobody has set.
void* refuse_without_init(std::size_t) {
  throw py::type_error("an object that was made by __new__ alone holds nothing: call its class, or give it a state");
}

void refuse_uninitialised(const py::module_& module) {
  for (const auto& named : py::dict(module.attr("__dict__"))) {
    if (!py::isinstance<py::type>(named.second)) continue;
    auto* const type = reinterpret_cast<PyTypeObject*>(named.second.ptr());
    if (py::detail::type_info* const info = py::detail::get_type_info(type)) info->operator_new = refuse_without_init;
  }
}

}  // namespace
}  // namespace energymargin::binding

// A class comes before the functions whose signatures name it.
PYBIND11_MODULE(_core, module) {
  using namespace energymargin::binding;
  module.doc() = "The compiled core of energymargin.";
  for (const auto bind : {bind_limit, bind_shapes, bind_bodies, bind_scene, bind_plan, bind_world, bind_regions,
                          bind_problem, bind_capture, bind_effort, bind_baselines, bind_batch, bind_probability}) {
    bind(module);
  }
  refuse_uninitialised(module);
  py::module_::import("atexit").attr("register")(py::cpp_function(&Gate::close));
}
