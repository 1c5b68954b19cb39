// Programs, each compiled when it is first called for.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "viewer/gl/gl_object.h"

namespace cairn::viewer::gl {

class Programs {
 public:
  /// Makes the program of a source (shaders.h) and names that it is compiled with ("DISCS
  /// LIGHTING") current. Throws Error (kSystem) if the driver refuses it.
  void use(std::string_view source, std::string_view names);

 private:
  std::map<std::pair<std::string_view, std::string>, Program> programs_;
};

}  // namespace cairn::viewer::gl
