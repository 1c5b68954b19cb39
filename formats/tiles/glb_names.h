// Numbers and names of binary glTF that its writer and its reader share.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "formats/schema.h"

namespace cairn::formats {

inline constexpr std::uint32_t kGlbMagic = 0x46546C67;  // "glTF"
inline constexpr std::uint32_t kGlbVersion = 2;
inline constexpr std::uint32_t kJsonChunk = 0x4E4F534A;    // "JSON"
inline constexpr std::uint32_t kBinaryChunk = 0x004E4942;  // "BIN"

inline constexpr const char* kPositionSemantic = "POSITION";
inline constexpr const char* kNormalSemantic = "NORMAL";
inline constexpr const char* kColorSemantic = "COLOR_0";

inline constexpr const char* kQuantizationExtension = "KHR_mesh_quantization";
inline constexpr const char* kMeshoptExtension = "EXT_meshopt_compression";
inline constexpr const char* kUnlitExtension = "KHR_materials_unlit";
inline constexpr const char* kMetadataExtension = "EXT_structural_metadata";

/// Semantics that begin with _ are an application's own.
inline bool is_property(std::string_view semantic) { return semantic.starts_with('_'); }
/// "_INTENSITY" of the attribute "intensity", and back. An identifier does not begin with a digit, so there the _ stays.
std::string semantic_of(std::string_view attribute);
std::string property_of(std::string_view semantic);

/// glTF's number for the type of a component (5121, ...). Requires one that glTF knows (kInvariant otherwise).
int component_type_of(ScalarType type);
/// The reverse.
std::optional<ScalarType> scalar_type_of(std::int64_t component_type);
/// "UINT8", ...: the name of the type in EXT_structural_metadata.
const char* property_type_of(ScalarType type);

}  // namespace cairn::formats
