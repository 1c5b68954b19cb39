#include "pipeline/commands/picture_flags.h"

#include <CLI/CLI.hpp>

#include "formats/error.h"
#include "pipeline/commands/viewing_flags.h"
#include "pipeline/publish.h"

namespace cairn::pipeline {
namespace {

/// A flag that may be given again and again, with one value each time.
CLI::Option* add_repeatable(CLI::App& parser, const char* name, std::vector<std::string>& values,
                            const char* help) {
  return parser.add_option(name, values, help)->allow_extra_args(false);
}

}  // namespace

PictureFlags::PictureFlags(CLI::App& parser) {
  const char* group = "Pictures";
  CLI::Option* budget =
      add_repeatable(parser, "--budget", budgets_,
                     "measure pictures of so many points at most, such as 500k or 3M, against "
                     "pictures of all that is visible; may be repeated")
          ->option_text("COUNT")
          ->group(group);
  add_repeatable(parser, "--camera", cameras_,
                 "auto, or EX,EY,EZ/TX,TY,TZ[/UX,UY,UZ[/FOV]], as render has it; may be repeated "
                 "[five views: four sides, and one from nearer]")
      ->option_text("CAMERA")
      ->group(group)
      ->needs(budget);
  parser.add_option("--size", size_, "of the pictures, pixels [1280x720]")
      ->option_text("WxH")
      ->group(group)
      ->needs(budget);
  add_repeatable(parser, "--draw", draw_,
                 "auto, points, discs or splats, as render has it; may be repeated [auto]")
      ->option_text("PRIMITIVE")
      ->check(CLI::IsMember({"auto", "points", "discs", "splats"}))
      ->group(group)
      ->needs(budget);
  parser
      .add_option("--cache", cache_,
                  "memory for nodes, which must hold all that a view shows, a size or a share such "
                  "as 25% [50%]")
      ->option_text("SIZE")
      ->group(group)
      ->needs(budget);
  parser
      .add_option("--pictures", folder_,
                  "a new folder to write the pictures and their differences (times 8) into")
      ->option_text("FOLDER")
      ->group(group)
      ->needs(budget);
}

std::optional<PictureOptions> PictureFlags::options(const formats::DatasetReader& dataset) const {
  if (budgets_.empty()) return std::nullopt;
  if (!folder_.empty()) require_free_place(folder_, /*force=*/false);
  PictureOptions options{.size = parse_picture_size(size_),
                         .draw_modes = {},
                         .cache_bytes = cache_.empty() ? 0 : parse_cache(cache_),
                         .folder = folder_};
  for (const std::string& budget : budgets_) options.budgets.push_back(parse_budget(budget));
  for (const std::string& mode : draw_) options.draw_modes.push_back(viewer::primitive_named(mode));
  if (cameras_.empty()) return options;
  const viewer::LodTree tree(dataset.tree(), dataset.header().grid, dataset.nodes());
  for (const std::string& camera : cameras_)
    options.cameras.push_back(camera == "auto" ? camera_around(tree.node(0).box, options.size)
                                               : viewer::parse_camera(camera));
  return options;
}

}  // namespace cairn::pipeline
