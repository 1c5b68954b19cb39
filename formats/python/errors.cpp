#include "formats/python/errors.h"

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <exception>
#include <string>
#include <utility>

#include "formats/error.h"
#include "formats/stopped.h"

namespace cairn::formats::python {
namespace {

namespace py = pybind11;

/// Names of files may hold any bytes; Python carries those that are no UTF-8 as it does in paths.
py::str text_of(const std::string& bytes) {
  PyObject* text =
      PyUnicode_DecodeFSDefaultAndSize(bytes.data(), static_cast<Py_ssize_t>(bytes.size()));
  if (text == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::str>(text);
}

py::object text_or_none(const std::string& bytes) {
  return bytes.empty() ? py::object(py::none()) : py::object(text_of(bytes));
}

void raise(const Error& error) {
  const ErrorParts& parts = error.parts();
  const py::object exception =
      py::module_::import("cairn._errors")
          .attr("exception_of")(static_cast<int>(error.kind()), text_of(error.what()),
                                text_or_none(parts.path.string()), parts.offset,
                                text_or_none(parts.found), text_or_none(parts.expected),
                                parts.system_errno);
  PyErr_SetObject(py::type::handle_of(exception).ptr(), exception.ptr());
}

}  // namespace

void register_errors() {
  py::register_local_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(std::move(thrown));
    } catch (const Error& error) {
      try {
        raise(error);
      } catch (py::error_already_set& failure) {
        failure.restore();
      }
    } catch (const Stopped&) {
      if (PyErr_Occurred() == nullptr) PyErr_SetNone(PyExc_KeyboardInterrupt);
    }
  });
}

bool has_raising_signal() {
  const py::gil_scoped_acquire locked;
  return PyErr_CheckSignals() != 0;
}

}  // namespace cairn::formats::python
