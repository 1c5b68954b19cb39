#include "tests/support/manifest.h"

#include <cmath>
#include <fstream>
#include <sstream>

namespace cairn::test {
namespace {

std::vector<std::string> split(const std::string& line, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(line);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

/// "-0.0586982" has a tolerance of 0.6e-7: rounded, with a little room for a last digit cut off.
ManifestEntry::Bound parse_bound(const std::string& text) {
  const std::size_t exponent_at = text.find_first_of("eE");
  const std::string mantissa = text.substr(0, exponent_at);
  const std::size_t point = mantissa.find('.');
  const int decimals =
      point == std::string::npos ? 0 : static_cast<int>(mantissa.size() - point - 1);
  const int exponent =
      exponent_at == std::string::npos ? 0 : std::stoi(text.substr(exponent_at + 1));
  return {std::stod(text), 0.6 * std::pow(10.0, exponent - decimals)};
}

std::optional<std::array<ManifestEntry::Bound, 6>> parse_box(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;)
    if (word != "..") words.push_back(word);
  if (words.size() != 6) return std::nullopt;
  std::array<ManifestEntry::Bound, 6> box;
  for (std::size_t i = 0; i < 6; ++i) box[i] = parse_bound(words[i]);
  return box;
}

}  // namespace

std::vector<ManifestEntry> read_manifest(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::vector<ManifestEntry> entries;
  std::string line;
  std::getline(stream, line);  // the names of the columns
  while (std::getline(stream, line)) {
    const std::vector<std::string> fields = split(line, '\t');
    if (fields.size() < 6) continue;
    ManifestEntry entry;
    entry.path = fields[0];
    entry.format = fields[2];
    entry.attributes = fields[4];
    const bool counted =
        !fields[3].empty() && fields[3].find_first_not_of("0123456789") == std::string::npos;
    if (counted) entry.points = std::stoull(fields[3]);
    entry.box = parse_box(fields[5]);
    entries.push_back(std::move(entry));
  }
  return entries;
}

}  // namespace cairn::test
