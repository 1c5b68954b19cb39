// The known word that a mistyped one was meant to be.
#pragma once

#include <span>
#include <string_view>

namespace cairn::pipeline {

/// The word of `known` with the least edits (insertions, deletions, replacements) from `word`; empty where all
/// need more than two and more than a third of its letters.
std::string_view nearest_word(std::string_view word, std::span<const std::string_view> known);

}  // namespace cairn::pipeline
