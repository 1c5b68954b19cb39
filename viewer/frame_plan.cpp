#include "viewer/frame_plan.h"

#include <array>
#include <utility>

#include "formats/dataset/node_frame.h"
#include "formats/error.h"

namespace cairn::viewer {
namespace {

/// Splats smaller than this many pixels in radius draw what points draw.
constexpr double kSmallestSplatPixels = 0.5;
/// Boxes of neighbors on one surface overlap in the picture; so many layers mean that there is but one surface.
constexpr double kOneSurfaceLayers = 4;

constexpr std::array kPrimitives{std::pair{Primitive::kPoints, std::string_view("points")},
                                 std::pair{Primitive::kDiscs, std::string_view("discs")},
                                 std::pair{Primitive::kSplats, std::string_view("splats")}};
constexpr std::array kColorSources{
    std::pair{ColorSource::kColor, std::string_view("color")},
    std::pair{ColorSource::kIntensity, std::string_view("intensity")},
    std::pair{ColorSource::kClassification, std::string_view("classification")},
    std::pair{ColorSource::kNormal, std::string_view("normal")},
    std::pair{ColorSource::kHeight, std::string_view("height")},
    std::pair{ColorSource::kPlain, std::string_view("plain")},
    std::pair{ColorSource::kLevel, std::string_view("level")},
    std::pair{ColorSource::kError, std::string_view("error")}};

template <typename Table, typename T>
std::string_view name_in(const Table& table, T value) {
  for (const auto& [entry, name] : table)
    if (entry == value) return name;
  return "?";
}

template <typename T, typename Table>
std::optional<T> named_in(const Table& table, std::string_view name) {
  for (const auto& [entry, entry_name] : table)
    if (entry_name == name) return entry;
  return std::nullopt;
}

void require(bool there, std::string_view wish, std::string_view lacking) {
  if (!there)
    formats::throw_usage(std::string(wish) + " needs " + std::string(lacking) +
                         ", which this dataset does not have");
}

/// The input's own colors; without them the light on the normals shows the shape, and without normals the height.
ColorSource choose_color(const SceneFacts& scene, const Wishes& wishes) {
  if (wishes.color) {
    const std::string_view name = name_of(*wishes.color);
    require(offers(scene, *wishes.color), "coloring by " + std::string(name), name);
    return *wishes.color;
  }
  if (scene.color) return ColorSource::kColor;
  return scene.normals ? ColorSource::kPlain : ColorSource::kHeight;
}

Primitive choose_primitive(const SceneFacts& scene, const ViewFacts& view, const Wishes& wishes) {
  if (wishes.primitive) return *wishes.primitive;
  if (view.splat_pixels < kSmallestSplatPixels) return Primitive::kPoints;
  return scene.normals ? Primitive::kSplats : Primitive::kDiscs;
}

}  // namespace

std::vector<ColorSource> color_sources() {
  std::vector<ColorSource> sources;
  sources.reserve(kColorSources.size());
  for (const auto& [source, name] : kColorSources) sources.push_back(source);
  return sources;
}

std::string_view attribute_of(ColorSource source) {
  switch (source) {
    case ColorSource::kColor:
      return formats::attribute_name::kColor;
    case ColorSource::kIntensity:
      return formats::attribute_name::kIntensity;
    case ColorSource::kClassification:
      return formats::attribute_name::kClassification;
    default:
      return {};
  }
}

bool offers(const SceneFacts& scene, ColorSource source) {
  switch (source) {
    case ColorSource::kColor:
      return scene.color;
    case ColorSource::kIntensity:
      return scene.intensity;
    case ColorSource::kClassification:
      return scene.classification;
    case ColorSource::kNormal:
      return scene.normals;
    default:
      return true;
  }
}

SceneFacts facts_of(const formats::DatasetHeader& header) {
  const auto attribute = [&](std::string_view name) -> const formats::Attribute* {
    const auto index = formats::find_attribute(header.schema, name);
    return index ? &header.schema[*index] : nullptr;
  };
  const auto is_integer = [](const formats::Attribute* a, std::uint32_t components) {
    return a != nullptr && a->components == components &&
           (a->type == formats::ScalarType::kU8 || a->type == formats::ScalarType::kU16);
  };
  const auto normal = formats::normal_attribute(header.schema);
  return {.normals = normal.has_value(),
          .normals_estimated = normal && header.schema[*normal].estimated,
          .color = is_integer(attribute(formats::attribute_name::kColor), 3),
          .intensity = attribute(formats::attribute_name::kIntensity) != nullptr,
          .classification = is_integer(attribute(formats::attribute_name::kClassification), 1)};
}

FramePlan plan_frame(const SceneFacts& scene, const ViewFacts& view, const Wishes& wishes,
                     bool queries) {
  if (wishes.lighting.value_or(false)) require(scene.normals, "lighting", "normals");
  if (wishes.cull_back_faces.value_or(false))
    require(scene.normals, "back-face culling", "normals");
  FramePlan plan;
  plan.primitive = choose_primitive(scene, view, wishes);
  plan.color = choose_color(scene, wishes);
  plan.oriented = scene.normals && plan.primitive == Primitive::kSplats;
  plan.lighting = scene.normals && wishes.lighting.value_or(true);
  // Estimated normals may be turned inside out: culling by them would tear holes.
  plan.cull_back_faces = scene.normals && wishes.cull_back_faces.value_or(!scene.normals_estimated);
  plan.eye_dome = wishes.eye_dome.value_or(!plan.lighting);
  plan.deferred_blending = wishes.deferred_blending && plan.primitive == Primitive::kSplats;
  // The groups of deferred blending have a depth each: there is none that a query could be tested against.
  plan.occlusion_queries = queries && !plan.deferred_blending &&
                           wishes.occlusion.value_or(view.depth_layers > kOneSurfaceLayers);
  plan.point_pixels = wishes.point_pixels;
  return plan;
}

ColumnSet columns_of(const FramePlan& plan) {
  const bool per_point = plan.color != ColorSource::kPlain && plan.color != ColorSource::kLevel &&
                         plan.color != ColorSource::kError;
  return {.radius = plan.primitive != Primitive::kPoints,
          .color = per_point,
          .normal = plan.lighting || plan.cull_back_faces || plan.oriented};
}

formats::SectionSet sections_of(const FramePlan& plan, const formats::DatasetHeader& header) {
  const ColumnSet columns = columns_of(plan);
  formats::SectionSet sections;
  sections.set(formats::kPositionSection);
  sections.set(formats::kRadiusSection, columns.radius);
  const auto normal = formats::normal_attribute(header.schema);
  if (normal && (columns.normal || plan.color == ColorSource::kNormal))
    sections.set(formats::kFirstAttributeSection + *normal);
  if (const auto color = formats::find_attribute(header.schema, attribute_of(plan.color)))
    sections.set(formats::kFirstAttributeSection + *color);
  return sections;
}

std::vector<std::string> passes_of(const FramePlan& plan) {
  std::vector<std::string> passes;
  if (plan.primitive == Primitive::kSplats) {
    if (plan.deferred_blending)
      passes = {"splat groups", "blend groups"};
    else
      passes = {"visibility", "blend", "normalize"};
  } else {
    passes.emplace_back(name_of(plan.primitive));
  }
  if (plan.occlusion_queries) passes.emplace_back("occlusion queries");
  if (plan.eye_dome) passes.emplace_back("eye-dome lighting");
  return passes;
}

std::vector<std::string> section_names(const formats::SectionSet& sections,
                                       const formats::DatasetHeader& header) {
  std::vector<std::string> names;
  if (sections[formats::kPositionSection]) names.emplace_back("position");
  if (sections[formats::kRadiusSection]) names.emplace_back("radius");
  for (std::size_t i = 0; i < header.schema.size(); ++i)
    if (sections[formats::kFirstAttributeSection + i]) names.push_back(header.schema[i].name);
  return names;
}

std::optional<Primitive> primitive_named(std::string_view name) {
  return named_in<Primitive>(kPrimitives, name);
}
std::optional<ColorSource> color_source_named(std::string_view name) {
  return named_in<ColorSource>(kColorSources, name);
}
std::string_view name_of(Primitive primitive) { return name_in(kPrimitives, primitive); }
std::string_view name_of(ColorSource source) { return name_in(kColorSources, source); }

}  // namespace cairn::viewer
