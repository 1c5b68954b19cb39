#include "pipeline/memory_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <ctime>
#include <fstream>
#include <sstream>

#include "formats/error.h"
#include "formats/lower_case.h"
#include "formats/scans/laz/worker.h"
#include "pipeline/human.h"

namespace cairn::pipeline {
namespace {

struct Unit {
  std::string_view name;
  double bytes;
};

constexpr double kKibi = 1024.0;
constexpr std::array<Unit, 15> kUnits{{
    {"", 1},
    {"b", 1},
    {"k", kKibi},
    {"kib", kKibi},
    {"kb", 1e3},
    {"m", kKibi* kKibi},
    {"mib", kKibi* kKibi},
    {"mb", 1e6},
    {"g", kKibi* kKibi* kKibi},
    {"gib", kKibi* kKibi* kKibi},
    {"gb", 1e9},
    {"t", kKibi* kKibi* kKibi* kKibi},
    {"tib", kKibi* kKibi* kKibi* kKibi},
    {"tb", 1e12},
    {"bytes", 1},
}};

/// The number at the start of a text, and what follows it without the spaces between.
std::optional<std::pair<double, std::string_view>> split_number(std::string_view text) {
  double number = 0;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), number, std::chars_format::fixed);
  if (error != std::errc{} || !std::isfinite(number) || number < 0) return std::nullopt;
  std::string_view rest = text.substr(static_cast<std::size_t>(end - text.data()));
  while (!rest.empty() && rest.front() == ' ') rest.remove_prefix(1);
  return std::pair{number, rest};
}

/// The number that a control file holds; nothing for "max", an absent file or nonsense.
std::optional<std::uint64_t> read_limit(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string word;
  if (!(in >> word)) return std::nullopt;
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// The tightest limit from `group` up to `hierarchy`: a group is bound by all above it. Inside a container
/// the group's path may be told as the host sees it and not exist here; then only the top is asked.
std::uint64_t tightest_limit(const std::filesystem::path& hierarchy,
                             const std::filesystem::path& group, const char* file) {
  std::uint64_t least = UINT64_MAX;
  for (std::filesystem::path at = group.relative_path(); !at.empty(); at = at.parent_path())
    if (const auto limit = read_limit(hierarchy / at / file)) least = std::min(least, *limit);
  if (const auto limit = read_limit(hierarchy / file)) least = std::min(least, *limit);
  return least;
}

std::uint64_t control_group_limit(const std::filesystem::path& root) {
  std::uint64_t least = UINT64_MAX;
  std::ifstream groups(root / "proc/self/cgroup");  // lines of "number:controllers:path"
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':');
    const std::size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",";
    const std::string group = line.substr(second + 1);
    if (controllers == ",,")
      least = std::min(least, tightest_limit(root / "sys/fs/cgroup", group, "memory.max"));
    else if (controllers.find(",memory,") != std::string::npos)
      least = std::min(
          least, tightest_limit(root / "sys/fs/cgroup/memory", group, "memory.limit_in_bytes"));
  }
  return least;
}

/// The value in bytes of a line such as "MemTotal:  24048 kB".
std::uint64_t read_kilobytes(const std::filesystem::path& file, std::string_view name) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string key;
    std::uint64_t kilobytes = 0;
    if (words >> key >> kilobytes && key == name) return kilobytes * 1024;
  }
  return 0;
}

}  // namespace

std::optional<std::uint64_t> parse_size(std::string_view text) {
  const auto number = split_number(text);
  if (!number) return std::nullopt;
  const std::string name = formats::lower_case(std::string(number->second));
  const auto unit =
      std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& u) { return u.name == name; });
  if (unit == kUnits.end()) return std::nullopt;
  const double bytes = number->first * unit->bytes;
  if (bytes >= 9.2e18) return std::nullopt;
  return static_cast<std::uint64_t>(bytes);
}

std::optional<std::uint64_t> parse_memory(std::string_view text, std::uint64_t machine_bytes) {
  if (text.empty() || text.back() != '%') return parse_size(text);
  const auto share = split_number(text.substr(0, text.size() - 1));
  if (!share || !share->second.empty() || share->first <= 0 || share->first > 100)
    return std::nullopt;
  return static_cast<std::uint64_t>(share->first / 100 * static_cast<double>(machine_bytes));
}

std::uint64_t machine_memory_bytes(const std::filesystem::path& root) {
  const std::uint64_t physical = read_kilobytes(root / "proc/meminfo", "MemTotal:");
  const std::uint64_t limit = control_group_limit(root);
  if (physical == 0) return limit == UINT64_MAX ? 0 : limit;
  return std::min(physical, limit);
}

std::uint64_t memory_budget(std::uint64_t asked_bytes, std::uint64_t machine_bytes) {
  return std::max(asked_bytes != 0 ? asked_bytes : machine_bytes / 2, kLeastMemoryBytes);
}

void require_memory(const std::string& what, std::uint64_t needed_bytes, std::uint64_t memory_bytes,
                    const std::string& remedy) {
  if (needed_bytes <= memory_bytes) return;
  constexpr std::uint64_t kMebi = 1 << 20;
  formats::throw_usage(
      fmt::format("{} needs {} of memory, of which {} may be used; {} memory to {}MiB", what,
                  human_bytes(needed_bytes), human_bytes(memory_bytes), remedy,
                  (needed_bytes + kMebi - 1) / kMebi));
}

void restart_peak_memory() {
  constexpr const char* kResetPeak = "5";  // proc(5), /proc/pid/clear_refs
  std::ofstream("/proc/self/clear_refs") << kResetPeak;
  formats::restart_laz_workers_peak();
}

double cpu_seconds() {
  timespec time{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::uint64_t peak_memory_bytes() {
  return read_kilobytes("/proc/self/status", "VmHWM:") + formats::laz_workers_peak_bytes();
}

}  // namespace cairn::pipeline
