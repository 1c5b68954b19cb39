#include "formats/scans/posed_scan.h"

#include <utility>

#include "formats/error.h"
#include "formats/scalar_value.h"

namespace cairn::formats {
namespace {

class PosedScan final : public ScanReader {
 public:
  PosedScan(std::unique_ptr<ScanReader> scan, const Pose& pose)
      : scan_(std::move(scan)), pose_(pose), normal_matrix_(normal_matrix(pose)) {
    info_ = scan_->info();
    info_.encoding = PositionEncoding::kFloat64;
    info_.scale = {1, 1, 1};
    info_.offset = {0, 0, 0};
    info_.pose.reset();
    if (info_.sensor) info_.sensor = place(pose, *info_.sensor);
  }

  std::size_t stretch_count() const override { return scan_->stretch_count(); }
  std::uint64_t stretch_capacity(std::size_t stretch) const override {
    return scan_->stretch_capacity(stretch);
  }
  std::uint64_t read_bytes() const override { return scan_->read_bytes(); }

  void read(std::size_t stretch, const BlockSink& sink) const override {
    PointBlock placed;
    scan_->read(stretch, [&](const PointBlock& block) {
      placed.count = block.count;
      placed.no_return = block.no_return;
      placed.columns = block.columns;
      place_positions(block, placed);
      turn_normals(placed);
      sink(placed);
    });
  }

 private:
  void place_positions(const PointBlock& block, PointBlock& placed) const {
    const ScanInfo& own = scan_->info();
    placed.world.resize(block.count);
    for (std::size_t i = 0; i < block.count; ++i) {
      Vector3 p;
      if (own.encoding == PositionEncoding::kSteps)
        for (std::size_t axis = 0; axis < 3; ++axis)
          p[axis] = own.offset[axis] + own.scale[axis] * block.steps[i][axis];
      else
        p = block.world[i];
      placed.world[i] = place(pose_, p);
    }
  }

  void turn_normals(PointBlock& placed) const {
    for (std::size_t a = 0; a < info_.schema.size(); ++a) {
      if (info_.schema[a].rule != ReduceRule::kNormal) continue;
      const ScalarType type = info_.schema[a].type;
      const std::size_t size = size_bytes(type);
      for (std::size_t i = 0; i < placed.count; ++i) {
        std::byte* at = placed.columns[a].data() + 3 * size * i;
        const Vector3 turned =
            multiply(normal_matrix_, {load_scalar(at, type), load_scalar(at + size, type),
                                      load_scalar(at + 2 * size, type)});
        for (std::size_t axis = 0; axis < 3; ++axis)
          store_scalar(at + axis * size, type, turned[axis]);
      }
    }
  }

  std::unique_ptr<ScanReader> scan_;
  Pose pose_;
  std::array<Vector3, 3> normal_matrix_;
};

}  // namespace

std::unique_ptr<ScanReader> place_scan(std::unique_ptr<ScanReader> scan, const Pose& pose) {
  if (!is_usable(pose))
    throw_input({.what = "the pose of a scan cannot be used",
                 .path = scan->info().path,
                 .expected = "finite numbers and a matrix that can be inverted"});
  return std::make_unique<PosedScan>(std::move(scan), pose);
}

}  // namespace cairn::formats
