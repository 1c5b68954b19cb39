// Meshes in Wavefront OBJ: lines of text, `v x y z` and `f i j k ...`, where an index counts from 1, or from the
// last vertex so far if it is negative, and may have texture and normal indices behind slashes.
// Based on: Wavefront Technologies, "Object Files (.obj)", Advanced Visualizer manual, appendix B.
#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "formats/buffered_reader.h"
#include "formats/error.h"
#include "formats/meshes/mesh_builder.h"
#include "formats/random_access_file.h"
#include "formats/scans/parse_number.h"

namespace cairn::formats {
namespace {

constexpr std::string_view kBlanks = " \t\v\f\r";

/// Takes the next word off the front of `line`; empty at the end.
std::string_view next_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(kBlanks));
  line.remove_prefix(word.size());
  return word;
}

class ObjReader {
 public:
  explicit ObjReader(const std::filesystem::path& path)
      : file_(path), reader_(file_), builder_(path) {}

  Mesh read() && {
    while (next_line()) {
      std::string_view rest = line_;
      const std::string_view kind = next_word(rest);
      if (kind == "v") read_vertex(rest);
      if (kind == "f") read_face(rest);
    }
    return std::move(builder_).take();
  }

 private:
  /// A line whose last character is a backslash goes on in the next.
  bool next_line() {
    offset_ = reader_.position();
    std::string_view part;
    if (!reader_.read_line(part)) return false;
    line_.assign(part);
    while (line_.ends_with('\\') && line_.size() < BufferedReader::kMaxLineBytes) {
      line_.back() = ' ';
      if (!reader_.read_line(part)) break;
      line_.append(part);
    }
    return true;
  }

  /// A fourth number, a weight or a colour, may follow.
  void read_vertex(std::string_view rest) {
    Vector3 position{};
    for (double& value : position) {
      const std::string_view word = next_word(rest);
      if (!parse_number(word, ScalarType::kF64, reinterpret_cast<std::byte*>(&value)))
        refuse("a vertex of the mesh has no three coordinates", word, "a number");
    }
    builder_.add_vertex(position, offset_);
  }

  void read_face(std::string_view rest) {
    indices_.clear();
    for (std::string_view word = next_word(rest); !word.empty() && !word.starts_with('#');
         word = next_word(rest))
      indices_.push_back(index_of(word));
    builder_.add_face(indices_, offset_);
  }

  std::uint64_t index_of(std::string_view word) const {
    const std::string_view digits = word.substr(0, word.find('/'));
    std::int64_t index = 0;
    const char* const end = digits.data() + digits.size();
    const auto parsed = std::from_chars(digits.data(), end, index);
    const auto count = static_cast<std::int64_t>(builder_.vertex_count());
    if (parsed.ec != std::errc{} || parsed.ptr != end || index == 0 || index < -count)
      refuse("a face of the mesh has no vertex", word,
             "an index from 1, or from -1 down to the first vertex");
    return static_cast<std::uint64_t>(index > 0 ? index - 1 : count + index);
  }

  [[noreturn]] void refuse(std::string what, std::string_view found, std::string expected) const {
    constexpr std::size_t kShownBytes = 40;
    throw_input({.what = std::move(what),
                 .path = file_.path(),
                 .offset = offset_,
                 .found = found.empty() ? "the end of the line"
                                        : fmt::format("'{}'", found.substr(0, kShownBytes)),
                 .expected = std::move(expected)});
  }

  RandomAccessFile file_;
  BufferedReader reader_;
  MeshBuilder builder_;
  std::string line_;
  std::uint64_t offset_ = 0;  ///< of the line
  std::vector<std::uint64_t> indices_;
};

}  // namespace

Mesh read_obj_mesh(const std::filesystem::path& path) { return ObjReader(path).read(); }

}  // namespace cairn::formats
