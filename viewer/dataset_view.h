// A dataset with all that draws it: source, renderer and scene, made for one plan.
#pragma once

#include <functional>
#include <memory>

#include "formats/dataset/dataset_reader.h"
#include "viewer/dataset_source.h"
#include "viewer/scene.h"

namespace cairn::viewer {

struct CacheOptions {
  std::uint64_t bytes = std::uint64_t{1}
                        << 30;  ///< of all nodes that are held, those under way too
  /// The renderer's slots lie in a memory of their own: half of the bytes is for decoded nodes beside them.
  bool beside_renderer = false;
  unsigned loader_threads = 1;
  bool prefetch = false;
  std::uint32_t uploads = UINT32_MAX;  ///< nodes handed to the renderer in one frame, at most
  std::function<void()> loaded{};      ///< called by threads of the loader when a node was read
};

/// Nodes that the renderer of a view has room for. Throws Error (kUsage) if the cache is too small.
std::uint32_t slots_of(const LodTree& tree, const FramePlan& plan, const CacheOptions& cache);

class DatasetView {
 public:
  using MakeRenderer = std::function<std::unique_ptr<Renderer>(const RendererSize& size)>;

  /// `dataset` and `tree` must outlive the view. Throws Error (kUsage) if the cache is too small.
  DatasetView(const formats::DatasetReader& dataset, const LodTree& tree, const FramePlan& plan,
              const CacheOptions& cache, const MakeRenderer& make_renderer);

  Scene& scene() { return scene_; }
  Renderer& renderer() { return *renderer_; }

 private:
  DatasetSource source_;
  FrontOptions front_;
  std::unique_ptr<Renderer> renderer_;
  Scene scene_;
};

}  // namespace cairn::viewer
