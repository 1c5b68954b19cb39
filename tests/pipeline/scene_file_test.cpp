// Scene files: what they say, and how wrong ones are refused.
#include "pipeline/scene_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/error.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace cairn::pipeline {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kStation = "[[station]]\nposition = [0, 0, 1.5]\ncounts = [10, 5]\n";
const std::string kObject = "[[object]]\ntype = \"sphere\"\nradius = 2\n";

std::string refusal(const std::string& text) {
  try {
    parse_scene(text, "site.toml");
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kUsage);
    return error.what();
  }
  return "no error";
}

TEST(SceneFile, HasDefaults) {
  const SceneFile scene = parse_scene(kObject + kStation, "some where/my_site.toml");
  EXPECT_EQ(scene.name, "my_site");
  EXPECT_EQ(scene.format, "ply");
  EXPECT_EQ(scene.frame, stages::ScanFrame::kSensor);
  ASSERT_EQ(scene.scene.stations.size(), 1U);
  const stages::Station& station = scene.scene.stations.front();
  EXPECT_EQ(station.name, "station_01");
  EXPECT_EQ(station.raster.columns, 10U);
  EXPECT_EQ(station.raster.azimuth_begin, -180);
  EXPECT_EQ(station.raster.elevation_end, 90);
  EXPECT_EQ(station.max_range, 100);
  EXPECT_THAT(station.position, ElementsAre(0, 0, 1.5));
}

TEST(SceneFile, AStepThatDoesNotFitTheRangeIsRounded) {
  const SceneFile scene = parse_scene(kObject +
                                          "[[station]]\nposition = [0, 0, 0]\nazimuth = [0, "
                                          "100]\nelevation = [-10, 10]\nstep = 3\n",
                                      "a.toml");
  EXPECT_EQ(scene.scene.stations[0].raster.columns, 33U);
  EXPECT_EQ(scene.scene.stations[0].raster.rows, 7U);
}

TEST(SceneFile, ObjectsAndStationsRepeat) {
  const SceneFile scene =
      parse_scene(kObject + "position = [1, 0, 0]\nrepeat = 3\nrepeat_step = [0, 2, 0]\n" +
                      "[[station]]\nname = \"s\"\nposition = [0, 0, 0]\nstep = 1\nrepeat = "
                      "12\nrepeat_step = [5, 0, 0]\n",
                  "a.toml");
  ASSERT_EQ(scene.scene.objects.size(), 3U);
  EXPECT_THAT(scene.scene.objects[2].pose.translation, ElementsAre(1, 4, 0));
  ASSERT_EQ(scene.scene.stations.size(), 12U);
  EXPECT_EQ(scene.scene.stations[0].name, "s_01");
  EXPECT_EQ(scene.scene.stations[11].name, "s_12");
  EXPECT_THAT(scene.scene.stations[11].position, ElementsAre(55, 0, 0));
}

TEST(SceneFile, RefusalsNameFileLineTableKeyAndWhatIsAllowed) {
  EXPECT_EQ(
      refusal(kObject + "radios = 1\n" + kStation),
      "site.toml, line 4: object 1: unknown key 'radios'; keys are type, radius, color, "
      "pattern, color2, pattern_size, leaf_area_density, walk, walk_time, position, rotation, "
      "repeat, repeat_step");
  EXPECT_EQ(refusal("[[object]]\ntype = \"sphere\"\nradius = -1\n" + kStation),
            "site.toml, line 3: object 1: radius: found -1, expected a length above 0");
  EXPECT_THAT(refusal("[[object]]\ntype = \"torus\"\n" + kStation),
              HasSubstr("line 2: object 1: type: found the string \"torus\", expected plane, box"));
  EXPECT_THAT(refusal("[[object]]\ntype = \"box\"\n" + kStation),
              HasSubstr("line 1: object 1: no key 'size': expected three lengths"));
  EXPECT_THAT(refusal(kStation), HasSubstr("no key 'object'"));
  EXPECT_THAT(refusal(kObject), HasSubstr("no key 'station'"));
  EXPECT_THAT(refusal("depth = 1\n" + kObject + kStation),
              HasSubstr("line 1: unknown key 'depth'"));
  EXPECT_THAT(refusal("object = 1\n" + kStation), HasSubstr("at least one table [[object]]"));
  EXPECT_THAT(refusal("object = [1]\n" + kStation), HasSubstr("at least one table [[object]]"));
  EXPECT_THAT(refusal("[output]\nformat = \"e57\"\n" + kObject + kStation),
              HasSubstr("line 2: output: format"));
  EXPECT_THAT(refusal("name = \"a/b\"\n" + kObject + kStation), HasSubstr("a name of letters"));
  EXPECT_THAT(refusal("x = \n"), HasSubstr("site.toml, line 1"));
}

TEST(SceneFile, RefusesImpossibleValues) {
  const auto object = [](const std::string& lines) {
    return refusal("[[object]]\n" + lines + kStation);
  };
  const auto station = [](const std::string& lines) {
    return refusal(kObject + "[[station]]\nposition = [0, 0, 0]\n" + lines);
  };
  const std::string sphere = "type = \"sphere\"\nradius = 1\n";
  for (const std::string lines :
       {"type = \"box\"\nsize = [1, 2]\n", "type = \"box\"\nsize = [1, 2, 0]\n",
        "type = \"box\"\nsize = [1, 2, nan]\n", "type = \"plane\"\nsize = 3\n",
        "type = \"tube\"\nradius = 1\npoints = [[0, 0, 0]]\n",
        "type = \"tube\"\nradius = 1\npoints = [[0, 0, 0], [0, 0, 0]]\n",
        "type = \"cylinder\"\nradius = 1\n", "type = \"statue\"\nheight = inf\n",
        "type = \"sphere\"\nradius = 1e13\n", "type = \"mesh\"\npath = \"a.stl\"\n", "type = 3\n"})
    EXPECT_THAT(object(lines), HasSubstr("site.toml, line")) << lines;
  for (const std::string lines :
       {"color = [256, 0, 0]\n", "color = [1.5, 0, 0]\n", "color = \"red\"\n",
        "color2 = [0, 0, 0]\n", "pattern = \"dots\"\n", "pattern_size = 1\n", "repeat = 0\n",
        "repeat = 2\n", "repeat_step = [1, 0, 0]\n", "position = [0, 0]\n",
        "rotation = [0, 0, true]\n"})
    EXPECT_THAT(object(sphere + lines), HasSubstr("object 1")) << lines;
  for (const std::string lines :
       {"", "step = 1\ncounts = [1, 1]\n", "step = 0\n", "step = 1e-9\n", "counts = [0, 1]\n",
        "counts = [1, 2000000]\n", "step = 1\nazimuth = [10, 10]\n",
        "step = 1\nazimuth = [-180, 181]\n", "step = 1\nelevation = [-91, 0]\n",
        "step = 1\nmax_range = 0\n", "step = 1\nmax_range = 1e10\n", "step = 1\nname = \"\"\n",
        "step = 1\nname = \"../x\"\n", "step = 1\nname = \"a b\"\n"})
    EXPECT_THAT(station(lines), HasSubstr("station 1")) << lines;
  EXPECT_THAT(
      refusal(kObject + "[[station]]\nname = \"station_02\"\nposition = [0, 0, 0]\nstep = 1\n" +
              kStation),
      HasSubstr("two stations have the name station_02"));
}

TEST(SceneFile, NamesEffects) {
  EXPECT_TRUE(parse_scene(kObject + kStation, "a.toml").effects.of_echoes.empty());
  const SceneFile scene = parse_scene(R"(
[effects]
seed = 9
range_noise = {base = 0.002, per_length = 1e-5}
registration_error = {translation = 0.01, rotation = 0.02}
[effects.dust]
mean_free_path = 300
color = [1, 2, 3]
)" + kObject + kStation,
                                      "a.toml");
  EXPECT_EQ(scene.effects.seed, 9U);
  ASSERT_TRUE(scene.effects.registration_error.has_value());
  EXPECT_EQ(scene.effects.registration_error->translation, 0.01);
  EXPECT_EQ(scene.effects.registration_error->rotation, 0.02);
  ASSERT_EQ(scene.effects.of_echoes.size(), 2U);
  EXPECT_EQ(scene.effects.of_echoes[0].kind, stages::EffectKind::kDust);
  EXPECT_EQ(scene.effects.of_echoes[1].kind, stages::EffectKind::kRangeNoise);
}

TEST(SceneFile, RefusesUnknownEffectsKeysAndImpossibleValues) {
  const auto effects = [](const std::string& lines) {
    return refusal("[effects]\n" + lines + "\n" + kObject + kStation);
  };
  EXPECT_THAT(effects("range_nose = {base = 1}"),
              HasSubstr("site.toml, line 2: effects: unknown key 'range_nose'; keys are seed, "));
  EXPECT_THAT(effects("[effects.dust]\nmean_free_path = 1\ncolour = [1, 2, 3]"),
              HasSubstr("site.toml, line 4: effects.dust: unknown key 'colour'; keys are "
                        "mean_free_path, color"));
  EXPECT_THAT(
      effects("[effects.outliers]\nshare = 1.5"),
      HasSubstr("line 3: effects.outliers: share: found 1.5, expected a number from 0 to 1"));
  EXPECT_THAT(effects("dropouts = {photons = 1}"),
              HasSubstr("line 2: effects.dropouts: no key 'reference_range'"));
  EXPECT_THAT(effects("exposure = 1"), HasSubstr("expected a table [effects.exposure]"));
  EXPECT_THAT(refusal("effects = 1\n" + kObject + kStation), HasSubstr("a table [effects]"));
  for (const std::string lines :
       {"seed = -1", "seed = 1.5", "range_noise = {base = -1}",
        "range_noise = {base = 1, per_length = -1}", "dust = {mean_free_path = 0}",
        "angular_jitter = {azimuth = 91, elevation = 0}",
        "intensity_falloff = {reference_range = 0}",
        "registration_error = {translation = nan, rotation = 0}",
        "exposure = {exposure = 11, white_balance = 0}"})
    EXPECT_THAT(effects(lines), HasSubstr("site.toml, line 2: effects")) << lines;
}

TEST(SceneFile, MeshesLieBesideTheSceneAndAreScaled) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "meshes/a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  test::write_text(folder / "site.toml",
                   "[[object]]\ntype = \"mesh\"\npath = \"meshes/a.obj\"\nscale = 3\n" + kStation);
  const SceneFile scene = read_scene(folder / "site.toml");
  EXPECT_THAT(scene.scene.objects[0].shape->whole().max, ElementsAre(3, 3, 0));
  EXPECT_THROW(read_scene(folder / "none.toml"), formats::Error);
}

TEST(SceneFile, TakesObjectsAndStationsOfItsBaseBeforeItsOwn) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "base.toml",
                   "[output]\nformat = \"las\"\n[effects]\nseed = 3\n" + kObject + kStation);
  const SceneFile same = parse_scene("base = \"base.toml\"", folder / "same.toml");
  EXPECT_EQ(same.name, "same");
  EXPECT_EQ(same.format, "ply");
  EXPECT_EQ(same.effects.seed, 0U);
  EXPECT_EQ(same.scene.objects.size(), 1U);
  EXPECT_EQ(same.scene.stations.size(), 1U);
  const std::string more = "base = \"base.toml\"\n" + kObject + "position = [5, 0, 0]\n" + kStation;
  const SceneFile both = parse_scene(more + "name = \"own\"\n", folder / "more.toml");
  ASSERT_EQ(both.scene.objects.size(), 2U);
  EXPECT_THAT(both.scene.objects[1].pose.translation, ElementsAre(5, 0, 0));
  ASSERT_EQ(both.scene.stations.size(), 2U);
  EXPECT_EQ(both.scene.stations[1].name, "own");
  const SceneFile unnamed = parse_scene(more, folder / "more.toml");
  EXPECT_EQ(unnamed.scene.stations[0].name, "station_01");
  EXPECT_EQ(unnamed.scene.stations[1].name, "station_02");
}

TEST(SceneFile, RefusesBasesThatCannotBe) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "a.toml", "base = \"a.toml\"");
  try {
    read_scene(folder / "a.toml");
    FAIL();
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kUsage);
    EXPECT_THAT(error.what(), HasSubstr("a.toml has a base itself"));
  }
  EXPECT_THAT(refusal("base = 3"), HasSubstr("site.toml, line 1: base"));
  EXPECT_THROW(parse_scene("base = \"none.toml\"", folder / "b.toml"), formats::Error);
}

TEST(SceneFile, ReadsMarksOfObjects) {
  const SceneFile scene =
      parse_scene(kObject + "leaf_area_density = 0.7\n" + kObject +
                      "walk = [1, 2, 3]\nwalk_time = 20\n" + kStation +
                      "[effects]\nfoliage = {returns = 3}\nmoving_objects = {scan_time = 9}\n"
                      "beam_divergence = {divergence = 0.02, resolution = 1}\n",
                  "a.toml");
  EXPECT_EQ(scene.scene.objects[0].leaf_area_density, 0.7);
  const stages::SceneObject& walker = scene.scene.objects[1];
  EXPECT_THAT(walker.walk, ElementsAre(1, 2, 3));
  EXPECT_EQ(walker.walk_time, 20);
  EXPECT_EQ(scene.effects.moving_objects->scan_time, 9);
  EXPECT_EQ(scene.effects.of_echoes.size(), 2U);
  for (const std::string lines : {"leaf_area_density = 0\n", "walk = [1, 2, 3]\n",
                                  "walk_time = 2\n", "walk = [1, 2, 3]\nwalk_time = 0\n"})
    EXPECT_THAT(refusal(kObject + lines + kStation), HasSubstr("object 1")) << lines;
  for (const std::string lines :
       {"foliage = {returns = 16}", "foliage = {blocked = 0}", "moving_objects = {scan_time = 0}",
        "beam_divergence = {divergence = 11, resolution = 1}",
        "beam_divergence = {divergence = 1, resolution = 1, rays = 1}"})
    EXPECT_THAT(refusal("[effects]\n" + lines + "\n" + kObject + kStation),
                HasSubstr("site.toml, line 2: effects."))
        << lines;
}

TEST(SceneFile, RefusesLeavesWhereABeamHasNotOneWayThroughThem) {
  for (const std::string shape :
       {"type = \"plane\"\nsize = [1, 1]\n", "type = \"statue\"\nheight = 4\n",
        "type = \"tube\"\nradius = 1\npoints = [[0, 0, 0], [0, 0, 9]]\n"})
    EXPECT_THAT(refusal("[[object]]\n" + shape + "leaf_area_density = 1\n" + kStation),
                HasSubstr("leaf_area_density asks for a box, a sphere or a cylinder"));
  EXPECT_THAT(
      refusal(kObject + "leaf_area_density = 1\nwalk = [1, 2, 3]\nwalk_time = 20\n" + kStation),
      HasSubstr("leaf_area_density and walk exclude each other"));
}

TEST(SceneFile, TheScenesOfTheProjectAreRead) {
  const auto scenes = test::files_in(CAIRN_SOURCE "/configs/scenes", ".toml");
  EXPECT_EQ(scenes.size(), 7U);
  for (const auto& path : scenes) {
    const SceneFile scene = read_scene(path);
    EXPECT_EQ(scene.name, path.stem().string());
    EXPECT_GE(scene.scene.stations.size(), 4U);
  }
}

}  // namespace
}  // namespace cairn::pipeline
