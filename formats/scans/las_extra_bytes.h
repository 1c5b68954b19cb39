// Extra bytes: what a LAS record holds behind the fields of its point format, and the descriptors
// that give it names and types (user id LASF_Spec, record id 4). Based on: ASPRS, LAS
// Specification 1.4 R15, "Extra Bytes". Values are carried as stored: a descriptor's scale, offset
// and no-data value are not applied but handed on.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "formats/scans/las_layout.h"
#include "formats/scans/scan_reader.h"
#include "formats/schema.h"

namespace cairn::formats {

inline constexpr std::size_t kExtraBytesDescriptorBytes = 192;

/// Turns the bytes behind the fields of `layout.point_format`, up to layout.record_length_bytes,
/// into attributes. Scalars become attributes under their sanitised names, the deprecated pairs and
/// triples have components, undocumented bytes are u8 x n; three consecutive floating scalars
/// NormalX, NormalY, NormalZ are `normal`. Bytes that no usable descriptor covers become
/// `extra_bytes`; descriptors of more bytes than the record has are left out, and so are those with which the
/// schema would have more than kMaxAttributes (limits.h).
/// `details`: what usable descriptors tell beside name and type is appended.
void append_extra_bytes(std::span<const std::byte> descriptors, Schema& schema, LasLayout& layout,
                        std::vector<AttributeDetails>& details);

/// The reverse, for a writer: appends the attribute to the end of the record and its descriptors, with the details that
/// there are, to `descriptors`. Throws kUsage if the record would exceed 65,535 bytes.
void append_extra_attribute(const Schema& schema, std::size_t attribute,
                            std::span<const AttributeDetails> details, LasLayout& layout,
                            std::vector<std::byte>& descriptors);

}  // namespace cairn::formats
