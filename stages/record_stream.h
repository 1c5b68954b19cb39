// How the points of a campaign's scans reach the stages that compare a dataset with them.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

namespace cairn::stages {

/// Takes canonical records of input points, `stride` bytes each: grid position, then the attributes of
/// formats::digest_schema, as RecordLayout with 12-byte positions lays them out.
using RecordSink = std::function<void(std::span<const std::byte> records, std::size_t stride)>;
/// Streams all points of the sources that import keeps into a sink, with the gains that the metadata tells applied, in
/// any order, from any number of threads at a time.
using RecordSource = std::function<void(const RecordSink&)>;

}  // namespace cairn::stages
