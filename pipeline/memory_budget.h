// How much memory a build may use: sizes as people write them, and what the machine has, which inside a
// container is what its control group allows.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace cairn::pipeline {

/// No build is promised to fit into less.
inline constexpr std::uint64_t kLeastMemoryBytes = std::uint64_t{64} << 20;

/// Bytes of "4GiB", "1.5 GB", "512M" or "1000000": KiB, MiB, GiB, TiB (or the letter alone) count by 1024,
/// kB, MB, GB, TB by 1000. Nothing if the text is no size.
std::optional<std::uint64_t> parse_size(std::string_view text);

/// A size, or a share such as "50%" (above 0, up to 100) of `machine_bytes`.
std::optional<std::uint64_t> parse_memory(std::string_view text, std::uint64_t machine_bytes);

/// Physical memory, or the tightest limit of the control groups (version 1 or 2) that this process is in,
/// whichever is less. `root` is the root of the file system that is asked, for tests.
std::uint64_t machine_memory_bytes(const std::filesystem::path& root = "/");

/// The memory of a build: `asked_bytes`, or half of the machine's if that is 0, but never less than
/// kLeastMemoryBytes.
std::uint64_t memory_budget(std::uint64_t asked_bytes, std::uint64_t machine_bytes);

/// Refuses settings that `needed_bytes` of memory do not suffice for, with the least value of the setting that does: "WHAT
/// needs ..., of which ... may be used; REMEDY memory to 108MiB". Throws Error (kUsage) if more is needed than allowed.
void require_memory(const std::string& what, std::uint64_t needed_bytes, std::uint64_t memory_bytes,
                    const std::string& remedy = "raise");

/// The largest resident memory that this process has had (VmHWM; 0 where that is not told), and the largest that its
/// worker processes have had together, since it began or since restart_peak_memory: at most, since the two may
/// not be at the same time.
std::uint64_t peak_memory_bytes();
/// Counts the peak from now on. Where the system does not allow that the peak stays that of the whole process.
void restart_peak_memory();
/// Processor time that all threads of this process have used so far.
double cpu_seconds();

}  // namespace cairn::pipeline
