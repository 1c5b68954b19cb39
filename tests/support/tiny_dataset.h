// A small correct dataset made by the plainest means: points in a row, groups of neighbours as
// clusters, every sum over input points by brute force. What the stages make must agree with it, and
// tests damage it to see whether the damage is found.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "formats/dataset/metadata.h"
#include "stages/clustered_node.h"
#include "stages/context.h"
#include "tests/support/temporary_folder.h"

namespace cairn::test {

struct TinyTree {
  formats::DatasetHeader header;
  std::vector<stages::ClusteredNode> nodes;  ///< in id order
  std::vector<std::byte> records;  ///< canonical records of all input points, in input order
  std::size_t record_stride = 0;
};

/// A header with normals, colours, classification and GPS times: 43 points, fan-out 2, 3 levels.
formats::DatasetHeader tiny_header();

/// Builds the tree of header.points points that wind along a helix of `spread` grid steps. The first
/// child of every node hands on `withheld` representatives fewer than it should.
TinyTree make_tiny_tree(formats::DatasetHeader header, std::int32_t spread = 40'000,
                        std::uint64_t withheld = 0);

/// A stages' context without threads, progress or arrays.
stages::Context plain_context();

/// Packs the nodes in the order given (`order` empty: by id) and writes the three files.
void write_tiny_dataset(const std::filesystem::path& directory, const TinyTree& tree,
                        const std::vector<std::size_t>& order = {},
                        formats::Codec codec = formats::Codec::kLzo);

/// Changes the index of a written dataset; all checksums are right again afterwards.
void edit_index(const std::filesystem::path& directory,
                const std::function<void(formats::DatasetIndex&)>& change);

std::vector<std::byte> read_file(const std::filesystem::path& path);
void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace cairn::test
