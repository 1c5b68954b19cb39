// Walk files: what they say, that what is written reads back, and how wrong ones are refused.
#include "viewer/walk_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

#include "formats/error.h"
#include "tests/support/temporary_folder.h"

namespace cairn::viewer {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kCamera = "[[camera]]\ntime = 0\neye = [1, 2, 3]\ntarget = [0, 0, 0]\n";

std::string refusal(const std::string& text) {
  try {
    parse_walk(text, "walk.toml");
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kUsage);
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "no error";
}

/// Any finite number: ordinary ones, whole ones, and any pattern of bits.
double any_double(std::mt19937_64& random) {
  switch (random() % 3) {
    case 0:
      return std::uniform_real_distribution(-1e7, 1e7)(random);
    case 1:
      return std::ldexp(static_cast<double>(random() % 1024) - 512,
                        static_cast<int>(random() % 60));
    default:
      break;
  }
  for (;;) {
    const auto number = std::bit_cast<double>(random());
    if (std::isfinite(number)) return number;
  }
}

Camera any_camera(std::mt19937_64& random) {
  for (;;) {
    const auto triple = [&] {
      return glm::dvec3(any_double(random), any_double(random), any_double(random));
    };
    Camera camera{.eye = triple(), .target = triple(), .up = triple()};
    camera.fov_y_degrees = std::uniform_real_distribution(0.001, 179.999)(random);
    if (fault_of(camera).empty()) return camera;
  }
}

TEST(WalkFile, HasDefaults) {
  const Walk walk = parse_walk(kCamera, "walk.toml");
  EXPECT_EQ(walk.frames_per_second(), 30);
  ASSERT_EQ(walk.keyframes().size(), 1U);
  const TimedCamera expected{
      0, {.eye = {1, 2, 3}, .target = {0, 0, 0}, .up = {0, 0, 1}, .fov_y_degrees = 50}};
  EXPECT_EQ(walk.keyframes()[0], expected);
}

TEST(WalkFile, SaysEverything) {
  const Walk walk = parse_walk(
      "# comment\nframes_per_second = 12.5\n" + kCamera +
          "[[camera]]\ntime = 1.5\neye = [1e3, -2, 0.25]\ntarget = [1, 1, 1]\nup = [0, 1, 0]\n"
          "fov = 35\n",
      "walk.toml");
  EXPECT_EQ(walk.frames_per_second(), 12.5);
  ASSERT_EQ(walk.keyframes().size(), 2U);
  const TimedCamera expected{
      1.5, {.eye = {1000, -2, 0.25}, .target = {1, 1, 1}, .up = {0, 1, 0}, .fov_y_degrees = 35}};
  EXPECT_EQ(walk.keyframes()[1], expected);
}

TEST(WalkFile, AnOrbitIsTheSameAsItsWalk) {
  const Walk walk = parse_walk(
      "[orbit]\ncenter = [1, 2, 3]\nradius = 4\nheight = 1\nseconds = 6\nturns = -2\nstart = 45\n"
      "fov = 60\n",
      "walk.toml");
  const Orbit orbit{.center = {1, 2, 3},
                    .radius = 4,
                    .height = 1,
                    .seconds = 6,
                    .turns = -2,
                    .start_degrees = 45,
                    .fov_y_degrees = 60};
  EXPECT_EQ(walk.keyframes(), orbit_walk(orbit).keyframes());
  EXPECT_EQ(parse_walk("orbit = {center = [0, 0, 0], radius = 1, seconds = 10}\n", "a").keyframes(),
            orbit_walk({}).keyframes());
}

TEST(WalkFile, WhatIsWrittenReadsBackBitByBit) {
  std::mt19937_64 random(7);
  const test::TemporaryFolder folder;
  for (int round = 0; round < 50; ++round) {
    std::vector<TimedCamera> keys;
    double time_s = 0;
    for (int i = 0; i < 20; ++i) {
      keys.push_back({time_s, any_camera(random)});
      time_s += std::exp(std::uniform_real_distribution(-30.0, 5.0)(random));
    }
    const Walk walk(keys, std::uniform_real_distribution(0.01, 100.0)(random));
    write_walk(walk, folder / "walk.toml");
    const Walk read = read_walk(folder / "walk.toml");
    EXPECT_EQ(read.keyframes(), keys);
    EXPECT_EQ(read.frames_per_second(), walk.frames_per_second());
    EXPECT_EQ(walk_text(read), walk_text(walk));  // tells -0 from 0 too
  }
}

TEST(WalkFile, WritesNumbersInTheirShortestForm) {
  const Camera camera{.eye = {0.1, -0.0, 1e300}, .target = {5e-324, 637100.25, 3}, .up = {0, 1, 0}};
  const std::string text = walk_text(Walk({{0, camera}}));
  EXPECT_EQ(text,
            "frames_per_second = 30.0\n\n[[camera]]\ntime = 0.0\neye = [0.1, -0.0, 1e+300]\n"
            "target = [5e-324, 637100.25, 3.0]\nup = [0.0, 1.0, 0.0]\nfov = 50.0\n");
  EXPECT_EQ(walk_text(parse_walk(text, "walk.toml")), text);
}

TEST(WalkFile, RefusalsNameFileLineKeyFoundAndExpected) {
  EXPECT_EQ(
      refusal(kCamera + "colour = 1\n"),
      "walk.toml, line 5: camera 1: unknown key 'colour'; keys are time, eye, target, up, fov");
  EXPECT_EQ(
      refusal(kCamera + "fov = \"wide\"\n"),
      "walk.toml, line 5: camera 1: fov: found the string \"wide\", expected a finite number");
  EXPECT_EQ(
      refusal(kCamera + "up = [0, 1]\n"),
      "walk.toml, line 5: camera 1: up: found [0, 1], expected three finite numbers: [x, y, z]");
  EXPECT_EQ(refusal(kCamera + kCamera),
            "walk.toml, line 6: camera 2: time: found 0, expected a time after 0, that of the "
            "camera before");
  EXPECT_EQ(
      refusal(kCamera + "[[camera]]\ntime = 1\neye = [0, 0, 0]\n"),
      "walk.toml, line 5: camera 2: no key 'target': expected three finite numbers: [x, y, z]");
  EXPECT_EQ(
      refusal(kCamera + "fov = 180\n"),
      "walk.toml, line 1: camera 1: a camera's field of view is 180 degrees, expected above 0 "
      "and below 180");
  EXPECT_EQ(
      refusal("frames_per_second = 0\n" + kCamera),
      "walk.toml, line 1: frames_per_second: found 0, expected a number above 0, at most 1000");
  EXPECT_EQ(refusal("speed = 2\n" + kCamera),
            "walk.toml, line 1: unknown key 'speed'; keys are frames_per_second, camera, orbit");
  EXPECT_THAT(refusal("\n[[camera]\n"), StartsWith("walk.toml, line 2: "));
}

TEST(WalkFile, RefusesWhatIsNoWalk) {
  const std::string orbit = "[orbit]\ncenter = [0, 0, 0]\nradius = 1\n";
  for (const std::string& text :
       {std::string(), std::string("# nothing\n"), std::string("frames_per_second = 30\n"),
        kCamera + orbit + "seconds = 1\n"})
    EXPECT_THAT(refusal(text), HasSubstr("expected tables [[camera]] or one table [orbit]"))
        << text;
  for (const std::string text :
       {"camera = 1\n", "camera = []\n", "camera = [1]\n", "[camera]\n", "camera = [[1, 2]]\n"})
    EXPECT_THAT(refusal(text), HasSubstr("line 1: camera: found ")) << text;
  EXPECT_THAT(refusal(orbit), HasSubstr("line 1: orbit: no key 'seconds'"));
  EXPECT_THAT(refusal(orbit + "seconds = 0\n"), StartsWith("walk.toml, line 1: orbit: "));
  EXPECT_THAT(refusal(orbit + "seconds = 1e18\n"), StartsWith("walk.toml, line 1: orbit: "));
  EXPECT_THAT(refusal("orbit = 3\n"), HasSubstr("found 3, expected a table [orbit]"));
  EXPECT_THAT(refusal("[[orbit]]\n"), HasSubstr("expected a table [orbit]"));
  EXPECT_THAT(refusal(kCamera + "[[camera]]\ntime = 1e300\neye = [1, 0, 0]\ntarget = [0, 0, 0]\n"),
              HasSubstr("at most 1000000 frames"));
}

TEST(WalkFile, RefusesNumbersThatAreNone) {
  const auto with = [](const std::string& key, const std::string& value) {
    std::string text = "[[camera]]\n";
    for (const auto& [name, plain] : {std::pair<std::string, std::string>{"time", "0"},
                                      {"eye", "[1, 2, 3]"},
                                      {"target", "[0, 0, 0]"},
                                      {"up", "[0, 0, 1]"},
                                      {"fov", "50"}})
      text += name + " = " + (name == key ? value : plain) + "\n";
    return refusal(text);
  };
  for (const std::string number : {"nan", "inf", "-inf", "1e999", "true", "1979-05-27", "\"1\""}) {
    for (const std::string key : {"time", "fov"})
      EXPECT_THAT(with(key, number), StartsWith("walk.toml, line ")) << key << number;
    for (const std::string key : {"eye", "target", "up"})
      EXPECT_THAT(with(key, "[0, " + number + ", 5]"), StartsWith("walk.toml, line "))
          << key << number;
  }
  EXPECT_THAT(with("time", "-1"),
              HasSubstr("line 2: camera 1: time: found -1, expected at least 0"));
  EXPECT_THAT(with("eye", "[0, 0, 0]"), HasSubstr("a camera whose eye is its target"));
  EXPECT_THAT(with("up", "[2, 4, 6]"), HasSubstr("looks along its up direction"));
  EXPECT_THAT(with("eye", "[1, 2, 3, 4, 5]"),
              HasSubstr("line 3: camera 1: eye: found an array of 5"));
  EXPECT_THAT(with("eye", "[[1], 2, 3]"), HasSubstr("found [an array, 2, 3]"));
}

TEST(WalkFile, EveryCutOfAFileIsReadOrRefused) {
  const std::string text =
      walk_text(Walk({{0, {.eye = {1.5, 2.25, 3}}}, {1, {.eye = {4, 5, 6}}}}, 25));
  for (std::size_t size = 0; size < text.size(); ++size) {
    const std::string outcome = refusal(text.substr(0, size));
    EXPECT_TRUE(outcome == "no error" || outcome.starts_with("walk.toml, line ")) << outcome;
  }
}

TEST(WalkFile, AFileThatCannotBeReadIsASystemError) {
  const test::TemporaryFolder folder;
  const auto kind_of = [](const std::filesystem::path& file) {
    try {
      read_walk(file);
    } catch (const formats::Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(file.string()));
      return error.kind();
    }
    return formats::ErrorKind::kInvariant;
  };
  EXPECT_EQ(kind_of(folder / "absent.toml"), formats::ErrorKind::kSystem);
  EXPECT_EQ(kind_of(folder.path()), formats::ErrorKind::kSystem);
  const auto large = folder.write("large.toml", std::string_view("# no walk\n"));
  std::filesystem::resize_file(large, (64 << 20) + 1);
  EXPECT_EQ(kind_of(large), formats::ErrorKind::kInput);
}

}  // namespace
}  // namespace cairn::viewer
