#include "viewer/gl/headless_context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "formats/error.h"
#include "tests/viewer/gl_fixture.h"

namespace cairn::viewer::tests {
namespace {

using HeadlessContextTest = GlTest;

TEST_F(HeadlessContextTest, IsCurrentAndCanBeMadeAgain) {
  EXPECT_GE(epoxy_gl_version(), 45);
  context_.reset();
  EXPECT_EQ(eglGetCurrentContext(), EGL_NO_CONTEXT);
  context_ = std::make_unique<HeadlessContext>();
  EXPECT_NE(glGetString(GL_RENDERER), nullptr);
}

/// Ends the process with the error's exit code and line.
[[noreturn]] void make_with(const char* variable, const char* value) {
  setenv(variable, value, 1);
  try {
    HeadlessContext context;
  } catch (const formats::Error& error) {
    std::cerr << error.what() << std::endl;
    std::_Exit(static_cast<int>(error.kind()));
  }
  std::_Exit(0);
}

// In a process of its own each, since libraries read the environment once. The variables are those
// of Mesa and of the vendor-neutral libEGL.

TEST(HeadlessContextDeathTest, SaysWhichVersionTheDriverHas) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  int status = 0;
  const auto keep = [&](int ended) {
    status = ended;
    return true;
  };
  EXPECT_EXIT(make_with("MESA_GL_VERSION_OVERRIDE", ""), keep, "");
  if (status != 0) GTEST_SKIP() << "there is no OpenGL 4.5 without a screen";
  EXPECT_EXIT(make_with("MESA_GL_VERSION_OVERRIDE", "3.3"), testing::ExitedWithCode(4),
              "^cannot draw with OpenGL: the driver is too old: found version 3\\.., expected "
              "4\\.5, core profile; --mode cpu needs none\n$");
}

TEST(HeadlessContextDeathTest, SaysThatThereIsNoSurfacelessPlatform) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(make_with("__EGL_VENDOR_LIBRARY_DIRS", "/nowhere"), testing::ExitedWithCode(4),
              "^cannot draw with OpenGL: EGL cannot do without a screen: found no surfaceless "
              "platform, expected EGL_MESA_platform_surfaceless; --mode cpu needs none\n$");
}

}  // namespace
}  // namespace cairn::viewer::tests
