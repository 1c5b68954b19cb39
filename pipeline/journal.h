// The journal of a build: which units of which stages are done, with what the stages told of them. It lies in the work
// folder and outlives the process, so that a build that was killed goes on from there.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/output_file.h"
#include "stages/unit_log.h"

namespace cairn::pipeline {

/// A file of entries, each with a checksum, written one behind the other. An entry that was cut off by a kill, and all
/// behind it, is as if it had never been written.
class Journal final : public stages::UnitLog {
 public:
  /// Opens the journal at `path`, or begins one. Throws Error (kSystem).
  explicit Journal(const std::filesystem::path& path);

  /// A stage begins whose results depend on what `key` is a hash of. What an earlier run told of its units holds if it had
  /// the same key, and is forgotten otherwise.
  void begin_stage(std::string_view stage, std::uint64_t key);
  /// Whether anything is done that a later run could go on with.
  bool has_units() const;
  bool has_units(std::string_view stage) const;
  /// Whether a stage has finished its last unit.
  bool is_done(std::string_view stage) const { return find(stage, stages::kStageDone).has_value(); }
  /// Forgets everything.
  void clear();

  std::optional<std::vector<std::byte>> find(std::string_view stage,
                                             std::uint64_t unit) const override;
  void finish(std::string_view stage, std::uint64_t unit,
              std::span<const std::byte> state) override;

 private:
  struct Extent {
    std::uint64_t offset = 0;
    std::uint64_t size_bytes = 0;
  };
  using Units = std::map<std::uint64_t, Extent>;

  std::uint64_t read_entries(const std::filesystem::path& path);
  bool set_key(std::string_view stage, std::uint64_t key);

  mutable std::mutex mutex_;
  std::optional<formats::OutputFile> file_;
  std::map<std::string, Units, std::less<>> stages_;
  std::map<std::string, std::uint64_t, std::less<>> keys_;
};

}  // namespace cairn::pipeline
