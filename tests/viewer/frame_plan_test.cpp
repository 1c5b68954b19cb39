// The rules that choose passes, columns and sections, each as a table.
#include "viewer/frame_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/error.h"

namespace cairn::viewer {
namespace {

using formats::Attribute;
using formats::DatasetHeader;
using formats::ReduceRule;
using formats::ScalarType;
using testing::ElementsAre;
using Names = std::vector<std::string>;

constexpr SceneFacts kBare{};
constexpr SceneFacts kNormals{.normals = true};
constexpr SceneFacts kEstimated{.normals = true, .normals_estimated = true};
constexpr SceneFacts kColored{.color = true};
constexpr SceneFacts kAll{
    .normals = true, .color = true, .intensity = true, .classification = true};

constexpr ColorSource kColorSources[] = {ColorSource::kColor,          ColorSource::kIntensity,
                                         ColorSource::kClassification, ColorSource::kNormal,
                                         ColorSource::kHeight,         ColorSource::kPlain,
                                         ColorSource::kLevel,          ColorSource::kError};
constexpr Primitive kPrimitives[] = {Primitive::kPoints, Primitive::kDiscs, Primitive::kSplats};

FramePlan plan_of(const SceneFacts& scene, const Wishes& wishes = {}, const ViewFacts& view = {},
                  bool queries = false) {
  return plan_frame(scene, view, wishes, queries);
}

/// A header of attributes in an order that differs from that of any enumeration here.
DatasetHeader full_header() {
  DatasetHeader header;
  header.schema = {{"gps_time", ScalarType::kF64, 1, ReduceRule::kNone},
                   {"classification", ScalarType::kU8, 1, ReduceRule::kMajority},
                   {"normal", ScalarType::kF32, 3, ReduceRule::kNormal},
                   {"intensity", ScalarType::kU16, 1, ReduceRule::kMean},
                   {"color", ScalarType::kU16, 3, ReduceRule::kMean}};
  return header;
}

/// Whether the plan is refused as a wrong wish, in one line that names what is lacking.
bool refused(const SceneFacts& scene, const Wishes& wishes, const std::string& lacking) {
  try {
    plan_of(scene, wishes);
  } catch (const formats::Error& error) {
    EXPECT_EQ(error.kind(), formats::ErrorKind::kUsage);
    EXPECT_THAT(error.what(), testing::HasSubstr(lacking));
    EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("\n")));
    return true;
  }
  return false;
}

TEST(FramePlan, NothingWished) {
  const struct {
    SceneFacts scene;
    FramePlan plan;
  } cases[] = {
      {kBare, {.primitive = Primitive::kDiscs, .color = ColorSource::kHeight, .eye_dome = true}},
      {kColored, {.primitive = Primitive::kDiscs, .color = ColorSource::kColor, .eye_dome = true}},
      {{.intensity = true, .classification = true},
       {.primitive = Primitive::kDiscs, .color = ColorSource::kHeight, .eye_dome = true}},
      {kNormals,
       {.primitive = Primitive::kSplats,
        .color = ColorSource::kPlain,
        .oriented = true,
        .lighting = true,
        .cull_back_faces = true}},
      {kEstimated,
       {.primitive = Primitive::kSplats,
        .color = ColorSource::kPlain,
        .oriented = true,
        .lighting = true}},
      {kAll,
       {.primitive = Primitive::kSplats,
        .color = ColorSource::kColor,
        .oriented = true,
        .lighting = true,
        .cull_back_faces = true}},
  };
  for (const auto& c : cases) EXPECT_EQ(plan_of(c.scene), c.plan) << &c - cases;
}

TEST(FramePlan, SplatsBelowAPixelAreDrawnAsPoints) {
  for (const SceneFacts& scene : {kBare, kNormals}) {
    const Primitive large = scene.normals ? Primitive::kSplats : Primitive::kDiscs;
    EXPECT_EQ(plan_of(scene, {}, {.splat_pixels = 0.49}).primitive, Primitive::kPoints);
    EXPECT_EQ(plan_of(scene, {}, {.splat_pixels = 0.5}).primitive, large);
    EXPECT_EQ(plan_of(scene, {}, {.splat_pixels = 40}).primitive, large);
    for (const Primitive wished : kPrimitives)
      for (const double pixels : {0.1, 40.0})
        EXPECT_EQ(plan_of(scene, {.primitive = wished}, {.splat_pixels = pixels}).primitive,
                  wished);
  }
}

TEST(FramePlan, OnlySplatsWithNormalsLieInTheSurface) {
  for (const Primitive primitive : kPrimitives) {
    EXPECT_FALSE(plan_of(kBare, {.primitive = primitive}).oriented);
    EXPECT_EQ(plan_of(kNormals, {.primitive = primitive}).oriented,
              primitive == Primitive::kSplats);
  }
}

TEST(FramePlan, TheLightAndTheDepthShadeInEachOthersPlace) {
  const struct {
    SceneFacts scene;
    std::optional<bool> lighting, eye_dome;
    bool lit, domed;
  } cases[] = {
      {kBare, {}, {}, false, true},      {kBare, false, {}, false, true},
      {kBare, {}, false, false, false},  {kNormals, {}, {}, true, false},
      {kNormals, true, {}, true, false}, {kNormals, false, {}, false, true},
      {kNormals, {}, true, true, true},  {kNormals, false, false, false, false},
      {kEstimated, {}, {}, true, false},
  };
  for (const auto& c : cases) {
    const FramePlan plan = plan_of(c.scene, {.lighting = c.lighting, .eye_dome = c.eye_dome});
    EXPECT_EQ(plan.lighting, c.lit) << &c - cases;
    EXPECT_EQ(plan.eye_dome, c.domed) << &c - cases;
  }
}

TEST(FramePlan, BackFacesAreCulledByNormalsOfTheInputOrAsWished) {
  const struct {
    SceneFacts scene;
    std::optional<bool> wish;
    bool culled;
  } cases[] = {{kBare, {}, false},       {kBare, false, false},     {kNormals, {}, true},
               {kNormals, true, true},   {kNormals, false, false},  {kEstimated, {}, false},
               {kEstimated, true, true}, {kEstimated, false, false}};
  for (const auto& c : cases)
    EXPECT_EQ(plan_of(c.scene, {.cull_back_faces = c.wish}).cull_back_faces, c.culled)
        << &c - cases;
}

TEST(FramePlan, OcclusionIsAskedWhereLayersHideOneAnother) {
  const struct {
    bool queries;
    double layers;
    std::optional<bool> wish;
    bool asked;
  } cases[] = {{true, 4, {}, false},      {true, 4.01, {}, true},  {true, 1, true, true},
               {true, 100, false, false}, {false, 100, {}, false}, {false, 100, true, false}};
  for (const auto& c : cases)
    EXPECT_EQ(plan_of(kBare, {.occlusion = c.wish}, {.depth_layers = c.layers}, c.queries)
                  .occlusion_queries,
              c.asked)
        << &c - cases;
}

TEST(FramePlan, DeferredBlendingIsOfSplatsAndExcludesQueries) {
  for (const Primitive primitive : kPrimitives) {
    const FramePlan plan = plan_of(
        kBare, {.primitive = primitive, .occlusion = true, .deferred_blending = true}, {}, true);
    EXPECT_EQ(plan.deferred_blending, primitive == Primitive::kSplats);
    EXPECT_EQ(plan.occlusion_queries, primitive != Primitive::kSplats);
    EXPECT_FALSE(plan_of(kBare, {.primitive = primitive}).deferred_blending);
  }
}

TEST(FramePlan, WhatIsWishedIsTakenWhereTheDatasetHasIt) {
  for (const ColorSource source : kColorSources)
    EXPECT_EQ(plan_of(kAll, {.color = source}).color, source);
  for (const ColorSource source :
       {ColorSource::kHeight, ColorSource::kPlain, ColorSource::kLevel, ColorSource::kError})
    EXPECT_EQ(plan_of(kBare, {.color = source}).color, source);
  EXPECT_EQ(plan_of(kBare, {.point_pixels = 7}).point_pixels, 7);
}

TEST(FramePlan, WishesThatTheDatasetCannotMeetAreRefused) {
  EXPECT_TRUE(refused(kColored, {.lighting = true}, "normals"));
  EXPECT_TRUE(refused(kColored, {.cull_back_faces = true}, "normals"));
  EXPECT_TRUE(refused(kColored, {.color = ColorSource::kNormal}, "normal"));
  EXPECT_TRUE(refused(kNormals, {.color = ColorSource::kColor}, "color"));
  EXPECT_TRUE(refused(kColored, {.color = ColorSource::kIntensity}, "intensity"));
  EXPECT_TRUE(refused(kColored, {.color = ColorSource::kClassification}, "classification"));
  EXPECT_FALSE(refused(kBare, {.lighting = false, .cull_back_faces = false}, ""));
}

TEST(FramePlan, FactsAreThoseOfTheSchema) {
  const SceneFacts all = facts_of(full_header());
  EXPECT_TRUE(all.normals && all.color && all.intensity && all.classification);
  EXPECT_FALSE(all.normals_estimated);
  const SceneFacts none = facts_of({});
  EXPECT_FALSE(none.normals || none.normals_estimated || none.color || none.intensity ||
               none.classification);
  DatasetHeader header = full_header();
  header.schema[2].estimated = true;
  EXPECT_TRUE(facts_of(header).normals_estimated);
  header.schema[4].type = ScalarType::kF32;  // colors are integers, here of three components
  EXPECT_FALSE(facts_of(header).color);
  header.schema[4] = {"color", ScalarType::kU8, 1, ReduceRule::kMean};
  EXPECT_FALSE(facts_of(header).color);
}

TEST(FramePlan, ColumnsAreThoseThatThePlanDrawsFrom) {
  for (const Primitive primitive : kPrimitives)
    for (const ColorSource color : kColorSources)
      for (int bits = 0; bits < 8; ++bits) {
        const FramePlan plan{.primitive = primitive,
                             .color = color,
                             .oriented = (bits & 1) != 0,
                             .lighting = (bits & 2) != 0,
                             .cull_back_faces = (bits & 4) != 0};
        const ColumnSet columns = columns_of(plan);
        EXPECT_EQ(columns.radius, primitive != Primitive::kPoints);
        EXPECT_EQ(columns.normal, bits != 0);
        const bool of_node = color == ColorSource::kPlain || color == ColorSource::kLevel ||
                             color == ColorSource::kError;
        EXPECT_EQ(columns.color, !of_node);
      }
}

TEST(FramePlan, SectionsAreThoseThatColumnsAreReadFrom) {
  const DatasetHeader header = full_header();
  const struct {
    FramePlan plan;
    Names sections;
  } cases[] = {
      {{}, {"position"}},
      {{.primitive = Primitive::kDiscs}, {"position", "radius"}},
      {{.primitive = Primitive::kSplats, .oriented = true}, {"position", "radius", "normal"}},
      {{.lighting = true}, {"position", "normal"}},
      {{.cull_back_faces = true}, {"position", "normal"}},
      {{.eye_dome = true}, {"position"}},
      {{.color = ColorSource::kColor}, {"position", "color"}},
      {{.color = ColorSource::kIntensity}, {"position", "intensity"}},
      {{.color = ColorSource::kClassification}, {"position", "classification"}},
      {{.color = ColorSource::kNormal}, {"position", "normal"}},
      {{.color = ColorSource::kHeight}, {"position"}},
      {{.color = ColorSource::kLevel}, {"position"}},
      {{.color = ColorSource::kError}, {"position"}},
      {{.primitive = Primitive::kDiscs, .color = ColorSource::kColor, .lighting = true},
       {"position", "radius", "normal", "color"}},
  };
  for (const auto& c : cases)
    EXPECT_EQ(section_names(sections_of(c.plan, header), header), c.sections) << &c - cases;
}

TEST(FramePlan, SectionsOfRepresentativesAndWeightsAreNeverRead) {
  const DatasetHeader header = full_header();
  for (const ColorSource color : kColorSources) {
    const auto sections = sections_of(plan_of(kAll, {.color = color}), header);
    EXPECT_FALSE(sections[formats::kRepresentativeSection]);
    EXPECT_FALSE(sections[formats::kWeightSection]);
    EXPECT_FALSE(sections[formats::kFirstAttributeSection]);  // gps_time
  }
}

TEST(FramePlan, PassesRunInTheOrderTold) {
  using Plan = FramePlan;
  EXPECT_THAT(passes_of(Plan{}), ElementsAre("points"));
  EXPECT_THAT(passes_of(Plan{.primitive = Primitive::kDiscs}), ElementsAre("discs"));
  EXPECT_THAT(passes_of(Plan{.primitive = Primitive::kSplats}),
              ElementsAre("visibility", "blend", "normalize"));
  EXPECT_THAT(passes_of(Plan{.primitive = Primitive::kSplats, .deferred_blending = true}),
              ElementsAre("splat groups", "blend groups"));
  EXPECT_THAT(passes_of(Plan{.eye_dome = true, .occlusion_queries = true}),
              ElementsAre("points", "occlusion queries", "eye-dome lighting"));
  // The light, and culling by normals, are part of drawing a point: no pass of their own.
  EXPECT_THAT(passes_of(Plan{.lighting = true, .cull_back_faces = true}), ElementsAre("points"));
}

TEST(FramePlan, NamesAreReadBack) {
  for (const ColorSource source : kColorSources)
    EXPECT_EQ(color_source_named(name_of(source)), source);
  for (const Primitive primitive : kPrimitives)
    EXPECT_EQ(primitive_named(name_of(primitive)), primitive);
  for (const char* wrong : {"", "auto", "Points", "points "}) {
    EXPECT_EQ(primitive_named(wrong), std::nullopt);
    EXPECT_EQ(color_source_named(wrong), std::nullopt);
  }
}

}  // namespace
}  // namespace cairn::viewer
