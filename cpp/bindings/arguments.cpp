#include "arguments.hpp"

#include <string>

namespace py = pybind11;

namespace energymargin::binding {
namespace {

using Dispatch = PyObject* (*)(PyObject*, PyObject* const*, Py_ssize_t, PyObject*);

// That of pybind11, the same for all functions.
Dispatch dispatch = nullptr;

PyMethodDef* definition(const py::handle& function) {
  return reinterpret_cast<PyCFunctionObject*>(function.ptr())->m_ml;
}

// Of a method without its self.
std::string signature_of(const py::detail::function_record& record) {
  const std::string text = record.signature;
  if (!record.is_method) return text;
  const std::size_t end = text.find_first_of(",)");
  return "(" + text.substr(text[end] == ',' ? end + 2 : end);
}

std::string title_of(const py::detail::function_record& record) {
  return record.is_constructor ? record.scope.attr("__name__").cast<std::string>() : record.name;
}

// The fault in words, or None.
py::object fault(const py::detail::function_record& record, PyObject* const* values, Py_ssize_t count,
                 PyObject* names) {
  py::list positional;
  for (Py_ssize_t i = record.is_method ? 1 : 0; i < count; ++i) positional.append(py::handle(values[i]));
  py::dict named;
  for (Py_ssize_t i = 0; names != nullptr && i < PyTuple_GET_SIZE(names); ++i) {
    named[py::handle(PyTuple_GET_ITEM(names, i))] = py::handle(values[count + i]);
  }
  return py::module_::import("energymargin.arguments")
      .attr("fault_of_call")(title_of(record), signature_of(record), positional, named);
}

// Whether the error is pybind11's, and not one that the function or a callback raised.
bool is_refusal(const py::error_already_set& error, const py::detail::function_record& record) {
  const std::string text = py::str(error.value());
  return text.rfind(std::string(record.name) + "(): incompatible ", 0) == 0;
}

PyObject* call(PyObject* function, PyObject* const* values, Py_ssize_t count, PyObject* names) {
  PyObject* const result = dispatch(function, values, count, names);
  if (result != nullptr || PyErr_ExceptionMatches(PyExc_TypeError) == 0) return result;
  py::error_already_set error;  // takes it
  try {
    const py::detail::function_record& record = *py::detail::function_record_ptr_from_PyObject(function);
    const py::object words = is_refusal(error, record) ? fault(record, values, count, names) : py::none();
    if (!words.is_none()) {
      PyErr_SetObject(PyExc_TypeError, words.ptr());
      return nullptr;
    }
  } catch (py::error_already_set& other) {
    if (!other.matches(PyExc_Exception)) {  // such as KeyboardInterrupt
      other.restore();
      return nullptr;
    }
  }
  error.restore();
  return nullptr;
}

void name_arguments_of(const py::handle& value) {
  py::handle function = value;
  if (Py_TYPE(function.ptr()) == &PyStaticMethod_Type) function = function.attr("__func__");
  if (PyInstanceMethod_Check(function.ptr())) function = PyInstanceMethod_GET_FUNCTION(function.ptr());
  PyObject* const record = PyCFunction_Check(function.ptr()) ? PyCFunction_GET_SELF(function.ptr()) : nullptr;
  if (record == nullptr || py::detail::function_record_ptr_from_PyObject(record) == nullptr) return;
  PyMethodDef* const method = definition(function);
  const auto wrapper = reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(&call));
  if (method->ml_flags != (METH_FASTCALL | METH_KEYWORDS) || method->ml_meth == wrapper) return;
  dispatch = reinterpret_cast<Dispatch>(reinterpret_cast<void (*)()>(method->ml_meth));
  method->ml_meth = wrapper;
}

}  // namespace

void name_refused_arguments(py::module_& module) {
  for (const auto& [name, value] : py::dict(module.attr("__dict__"))) {
    name_arguments_of(value);
    if (!py::isinstance<py::type>(value)) continue;
    for (const auto& [member_name, member] : py::dict(value.attr("__dict__"))) name_arguments_of(member);
  }
}

}  // namespace energymargin::binding
