// A folder that vanishes with the test.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace cairn::test {

class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(std::string_view name) const { return path_ / name; }

  /// Writes a file into the folder, replacing one of that name, and returns its path.
  std::filesystem::path write(std::string_view name, std::span<const std::byte> bytes) const;
  std::filesystem::path write(std::string_view name, std::string_view text) const;

 private:
  std::filesystem::path path_;
};

/// Writes a file, and makes the folders that it needs.
void write_text(const std::filesystem::path& path, std::string_view text);

/// The bytes of a whole file.
std::string read_text(const std::filesystem::path& path);

}  // namespace cairn::test
