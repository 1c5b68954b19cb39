// How objects of Python share what C++ has opened, so that its end never harms the interpreter, whoever lets go of it last.
#pragma once

#include <pybind11/pybind11.h>
#include <unistd.h>

#include <memory>

namespace cairn::formats::python {

/// Without the interpreter's lock where this thread has it: closing waits for the thread that talks to a server. In a
/// process that inherited the object by fork, what reads from a server is left as it is: its thread is in the parent
/// alone, and its locks may never open.
class Release {
 public:
  template <typename T>
  void operator()(const T* object) const {
    if (object->is_remote() && made_in_ != ::getpid()) return;
    if (PyGILState_Check() == 0) {
      delete object;
      return;
    }
    const pybind11::gil_scoped_release unlocked;
    delete object;
  }

 private:
  pid_t made_in_ = ::getpid();
};

/// `T` tells by is_remote() whether it reads from a server.
template <typename T>
std::shared_ptr<T> share(std::unique_ptr<T> object) {
  return std::shared_ptr<T>(object.release(), Release());
}

}  // namespace cairn::formats::python
