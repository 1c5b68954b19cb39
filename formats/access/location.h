// Where a dataset is: a folder, or the http(s) address of one.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace cairn::formats {

class Location {
 public:
  /// What begins with http:// or https:// is an address, all else a path. Throws Error (kUsage) for an address
  /// that cannot be a folder's: without a host, with a user name, a query or a fragment, or with a character
  /// that an address may not have.
  Location(std::string
               text);  // NOLINT(google-explicit-constructor): paths stand where locations are taken
  Location(const char* text) : Location(std::string(text)) {}               // NOLINT
  Location(const std::filesystem::path& path) : Location(path.string()) {}  // NOLINT

  bool is_remote() const { return remote_; }
  /// The folder; of an address its text, which messages name as they name paths. An address has its
  /// scheme in lower case and no slash at the end.
  const std::filesystem::path& path() const { return path_; }
  /// A file in the folder.
  std::filesystem::path file(std::string_view name) const;
  /// The last part of the path: "site.cairn" of "http://host/site.cairn/".
  std::string name() const;

 private:
  std::filesystem::path path_;
  bool remote_ = false;
};

/// Whether the text is taken for an address: it begins with http:// or https://, in any case.
bool is_address(std::string_view text);

}  // namespace cairn::formats
