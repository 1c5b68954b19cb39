#include "pipeline/journal.h"

#include <array>
#include <cstring>

#include "formats/bytes.h"
#include "formats/checksum.h"
#include "formats/error.h"
#include "formats/random_access_file.h"

namespace cairn::pipeline {
namespace {

using formats::load_le;
using formats::store_le;

// An entry: checksum of all that follows, size of the stage's name, unit, size of the state; name; state.
constexpr std::size_t kHeadBytes = 32;
constexpr std::size_t kMostNameBytes = 64;
/// The unit that stands for the key of a stage; no stage counts so far.
constexpr std::uint64_t kKeyUnit = UINT64_MAX - 16;

std::vector<std::byte> entry_of(std::string_view stage, std::uint64_t unit,
                                std::span<const std::byte> state) {
  CAIRN_CHECK(stage.size() <= kMostNameBytes);
  std::vector<std::byte> entry(kHeadBytes + stage.size() + state.size());
  store_le(&entry[8], std::uint64_t{stage.size()});
  store_le(&entry[16], unit);
  store_le(&entry[24], std::uint64_t{state.size()});
  std::memcpy(&entry[kHeadBytes], stage.data(), stage.size());
  if (!state.empty()) std::memcpy(&entry[kHeadBytes + stage.size()], state.data(), state.size());
  store_le(entry.data(), formats::checksum_of(std::span(entry).subspan(8)));
  return entry;
}

/// The bytes of the entry at `offset`; empty where there is no whole one.
std::vector<std::byte> read_entry(const formats::RandomAccessFile& file, std::uint64_t offset) {
  const std::uint64_t rest = file.size_bytes() - offset;
  if (rest < kHeadBytes) return {};
  std::vector<std::byte> entry(kHeadBytes);
  file.read_exactly(offset, entry);
  const auto name_bytes = load_le<std::uint64_t>(&entry[8]);
  const auto state_bytes = load_le<std::uint64_t>(&entry[24]);
  if (name_bytes > kMostNameBytes || name_bytes > rest - kHeadBytes ||
      state_bytes > rest - kHeadBytes - name_bytes)
    return {};
  entry.resize(kHeadBytes + name_bytes + state_bytes);
  file.read_exactly(offset, entry);
  if (load_le<std::uint64_t>(entry.data()) != formats::checksum_of(std::span(entry).subspan(8)))
    return {};
  return entry;
}

}  // namespace

Journal::Journal(const std::filesystem::path& path) {
  const bool there = std::filesystem::exists(path);
  const std::uint64_t whole_bytes = there ? read_entries(path) : 0;
  file_.emplace(there ? formats::OutputFile::reopen(path, whole_bytes)
                      : formats::OutputFile::create(path));
}

std::uint64_t Journal::read_entries(const std::filesystem::path& path) {
  const formats::RandomAccessFile file(path);
  std::uint64_t offset = 0;
  while (true) {
    const std::vector<std::byte> entry = read_entry(file, offset);
    if (entry.empty()) return offset;
    const auto name_bytes = load_le<std::uint64_t>(&entry[8]);
    const std::string stage(reinterpret_cast<const char*>(&entry[kHeadBytes]), name_bytes);
    const auto unit = load_le<std::uint64_t>(&entry[16]);
    const std::uint64_t state = kHeadBytes + name_bytes;
    if (unit == kKeyUnit && entry.size() == state + 8)
      set_key(stage, load_le<std::uint64_t>(&entry[state]));
    else
      stages_[stage][unit] = {offset + state, entry.size() - state};
    offset += entry.size();
  }
}

bool Journal::set_key(std::string_view stage, std::uint64_t key) {
  const auto known = keys_.find(stage);
  if (known != keys_.end() && known->second == key) return false;
  keys_.insert_or_assign(std::string(stage), key);
  if (const auto units = stages_.find(stage); units != stages_.end()) stages_.erase(units);
  return true;
}

void Journal::begin_stage(std::string_view stage, std::uint64_t key) {
  const std::lock_guard lock(mutex_);
  if (!set_key(stage, key)) return;
  std::array<std::byte, 8> state;
  store_le(state.data(), key);
  file_->append(entry_of(stage, kKeyUnit, state));
}

bool Journal::has_units() const {
  const std::lock_guard lock(mutex_);
  return !stages_.empty();
}

bool Journal::has_units(std::string_view stage) const {
  const std::lock_guard lock(mutex_);
  return stages_.contains(stage);
}

void Journal::clear() {
  const std::lock_guard lock(mutex_);
  stages_.clear();
  keys_.clear();
  file_.emplace(formats::OutputFile::create(file_->path()));
}

std::optional<std::vector<std::byte>> Journal::find(std::string_view stage,
                                                    std::uint64_t unit) const {
  const std::lock_guard lock(mutex_);
  const auto units = stages_.find(stage);
  if (units == stages_.end()) return std::nullopt;
  const auto extent = units->second.find(unit);
  if (extent == units->second.end()) return std::nullopt;
  std::vector<std::byte> state(extent->second.size_bytes);
  file_->read_at(extent->second.offset, state);
  return state;
}

void Journal::finish(std::string_view stage, std::uint64_t unit, std::span<const std::byte> state) {
  const std::vector<std::byte> entry = entry_of(stage, unit, state);
  // Under the lock, so that no hole is left before an entry that is whole.
  const std::lock_guard lock(mutex_);
  CAIRN_CHECK(
      keys_.contains(stage));  // without a key a later run would believe it with any settings
  const std::uint64_t offset = file_->append(entry);
  stages_[std::string(stage)][unit] = {offset + entry.size() - state.size(), state.size()};
}

}  // namespace cairn::pipeline
