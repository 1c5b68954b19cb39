// Only the effects that a scene calls for: the one place that decides which passes a frame runs, and with them which
// columns exist and which sections are read from disk. What is not called for is not allocated, not run, not read.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/dataset/node_codec.h"
#include "formats/dataset/node_record.h"
#include "viewer/point_columns.h"

namespace cairn::viewer {

enum class Primitive {
  kPoints,  ///< squares of a fixed number of pixels
  kDiscs,   ///< round, facing the eye, as large as the splat radius appears
  kSplats,  ///< discs in the surface (with a normal) or facing the eye, blended where they lie on one surface
};

enum class ColorSource {
  kColor,
  kIntensity,
  kClassification,
  kNormal,
  kHeight,
  kPlain,
  kLevel,  ///< of the node
  kError,  ///< of the node: its bound on the screen
};

/// All of them, the most telling first.
std::vector<ColorSource> color_sources();
/// The attribute that a source of color is read from; empty for what needs none.
std::string_view attribute_of(ColorSource source);

/// What a user asks for; what is not set is decided here.
struct Wishes {
  std::optional<Primitive> primitive;
  std::optional<ColorSource> color;
  std::optional<bool> lighting;
  std::optional<bool> eye_dome;
  std::optional<bool> cull_back_faces;
  std::optional<bool> occlusion;
  bool deferred_blending = false;
  float point_pixels = 1;  ///< side of a point; 1 to 64
};

/// What a dataset brings.
struct SceneFacts {
  bool normals = false;
  bool normals_estimated = false;  ///< which may be turned inside out
  bool color = false;
  bool intensity = false;
  bool classification = false;
};
SceneFacts facts_of(const formats::DatasetHeader& header);
/// Whether a dataset can be colored so.
bool offers(const SceneFacts& scene, ColorSource source);

/// What a view asks for.
struct ViewFacts {
  double splat_pixels = 1e9;  ///< the largest splat radius on the front
  double depth_layers =
      1e9;  ///< how many regions lie behind one another, on average over the covered picture
};

struct FramePlan {
  Primitive primitive = Primitive::kPoints;
  ColorSource color = ColorSource::kPlain;
  bool oriented = false;  ///< splats lie in the surface, by their normals, and do not face the eye
  bool lighting = false;  ///< by a light at the eye
  bool cull_back_faces = false;
  bool eye_dome = false;
  bool occlusion_queries = false;
  bool deferred_blending = false;
  float point_pixels = 1;

  friend bool operator==(const FramePlan&, const FramePlan&) = default;
};

/// Throws Error (kUsage) for a wish that the dataset cannot meet. Without `queries` the renderer has no occlusion queries.
FramePlan plan_frame(const SceneFacts& scene, const ViewFacts& view, const Wishes& wishes,
                     bool queries);

/// The columns that a plan draws from.
ColumnSet columns_of(const FramePlan& plan);
/// The sections that these columns are read from.
formats::SectionSet sections_of(const FramePlan& plan, const formats::DatasetHeader& header);
/// Names for statistics: of the passes in the order in which they run, and of the sections.
std::vector<std::string> passes_of(const FramePlan& plan);
std::vector<std::string> section_names(const formats::SectionSet& sections,
                                       const formats::DatasetHeader& header);

std::optional<Primitive> primitive_named(std::string_view name);  ///< points, discs, splats
std::optional<ColorSource> color_source_named(
    std::string_view name);  ///< color, intensity, class, normal, height, ...
std::string_view name_of(Primitive primitive);
std::string_view name_of(ColorSource source);

}  // namespace cairn::viewer
