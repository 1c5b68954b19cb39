// Heads of HTTP answers, line by line, and fronts as the disk's cache keeps them. An answer that is taken for good holds the
// range that was asked for, of the version that is read.
#include <algorithm>
#include <string_view>

#include "formats/access/fetch_job.h"
#include "formats/access/http_answer.h"
#include "tests/fuzz/fuzz_target.h"

namespace cairn::fuzz {
namespace {

using namespace formats;

void check(const RangeQuestion& question, const HttpAnswer& answer) {
  const Judgement judgement = judge(question, answer);
  if (judgement.verdict != Verdict::kGood) return;
  const ContentRange& range = judgement.range;
  require(range.first == question.first && range.last <= question.last);
  require(range.last < range.total && range.first <= range.last);
  require(range.last == question.last || range.last + 1 == range.total);
  require(!question.size_bytes || *question.size_bytes == range.total);
  require(question.unless_same || !question.validators.any() ||
          answer.validators() == question.validators);
}

}  // namespace

void run(std::span<const std::byte> bytes) {
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  HttpAnswer answer;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
    answer.take_line(text.substr(0, end));
    text.remove_prefix(end);
    for (const char c : answer.validators().etag + answer.validators().last_modified)
      require(static_cast<unsigned char>(c) >= 0x20 && c != 0x7f);
  }
  const Validators version{"\"a\"", ""};
  check({.first = 100, .last = 199, .size_bytes = 1000, .validators = version}, answer);
  check({.first = 0, .last = 199, .size_bytes = {}, .validators = {}}, answer);
  check({.first = 0,
         .last = UINT64_MAX,
         .size_bytes = {},
         .validators = version,
         .unless_same = true},
        answer);
  if (const auto front = decode_front(bytes))
    require(!front->bytes->empty() && front->bytes->size() <= front->file_size_bytes);
}

}  // namespace cairn::fuzz
