// Adaptive arithmetic decoding as LASzip does it, as far as a chunk table needs it.
// Based on: A. Said, "Introduction to Arithmetic Coding - Theory and Practice", HPL-2004-76, 2004 (the
// coder); M. Isenburg, "LASzip: lossless compression of LiDAR data", 2013 (integers by the number of
// their bits). Bytes behind the end of the input read as zeros and are counted, so a damaged input ends
// in wrong numbers and never outside of its span.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace cairn::formats {

/// Probabilities of the symbols 0 to n - 1, learnt from those decoded.
class SymbolModel {
 public:
  explicit SymbolModel(std::uint32_t symbols);

 private:
  friend class ArithmeticDecoder;
  void count(std::uint32_t symbol);
  void update();

  std::vector<std::uint32_t> counts_;
  std::vector<std::uint32_t> cumulative_;  ///< of 2^15: how likely a smaller symbol is
  std::uint32_t total_ = 0;
  std::uint32_t cycle_ = 0;
  std::uint32_t until_update_ = 0;
};

/// The same for one bit.
class BitModel {
 private:
  friend class ArithmeticDecoder;
  void count(bool bit);

  std::uint32_t zeros_ = 1;
  std::uint32_t total_ = 2;
  std::uint32_t zero_probability_ = 1U << 12;  ///< of 2^13
  std::uint32_t cycle_ = 4;
  std::uint32_t until_update_ = 4;
};

class ArithmeticDecoder {
 public:
  /// `bytes` must outlive the decoder.
  explicit ArithmeticDecoder(std::span<const std::byte> bytes);

  std::uint32_t symbol(SymbolModel& model);
  bool bit(BitModel& model);
  /// A number of 1 to 32 bits without a model.
  std::uint32_t bits(std::uint32_t count);

  /// Bytes used so far; more than the span has if it ended too early.
  std::uint64_t consumed_bytes() const { return consumed_; }

 private:
  std::uint32_t next_byte();
  void renormalise();

  std::span<const std::byte> bytes_;
  std::uint64_t consumed_ = 0;
  std::uint32_t value_ = 0;
  std::uint32_t length_ = 0xffffffffU;
};

/// Integers of 32 bits, told by how much they differ from a prediction. How long the differences are is
/// learnt for each context, their bits for all together.
class IntegerDecoder {
 public:
  explicit IntegerDecoder(std::size_t contexts);
  std::uint32_t decode(ArithmeticDecoder& decoder, std::size_t context, std::uint32_t predicted);

 private:
  std::vector<SymbolModel> bit_counts_;
  BitModel zero_or_one_;              ///< a difference of no bits
  std::vector<SymbolModel> leading_;  ///< of k bits, the leading ones; entry k - 1
};

}  // namespace cairn::formats
