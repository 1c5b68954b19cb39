// What OpenGL finds wrong becomes an exception.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace cairn::viewer::gl {

/// Watches the context that is current where it is made, which must be current where it is used and
/// destroyed.
class ErrorWatch {
 public:
  /// In builds with assertions, a debug context's own words on an error are kept for the exception.
  ErrorWatch();
  ~ErrorWatch();
  ErrorWatch(const ErrorWatch&) = delete;
  ErrorWatch& operator=(const ErrorWatch&) = delete;

  /// Throws Error (kSystem) where the driver has run out of memory, kInvariant for any other error
  /// that it told since the last call. `doing`: what was done, in words ("allocating slots of
  /// points").
  void check(std::string_view doing);

 private:
  std::unique_ptr<std::string> message_ =
      std::make_unique<std::string>();  ///< the driver has its address
};

}  // namespace cairn::viewer::gl
