#include "pipeline/failure.h"

#include <cstdio>
#include <exception>
#include <new>
#include <system_error>
#include <utility>

#include "pipeline/human.h"
#include "pipeline/terminal.h"

namespace cairn::pipeline {

using formats::ErrorKind;

namespace {

void tell(const char* kind, std::string text) {
  const Paint paint = Paint::for_stderr();
  const std::string head = std::string("cairn: ") + kind + ":";
  const std::string line =
      (std::string_view(kind) == "error" ? paint.bad(head) : paint.doubtful(head)) + " " +
      printable(std::move(text)) + "\n";
  std::fwrite(line.data(), 1, line.size(), stderr);
}

}  // namespace

int fail(std::string text, ErrorKind kind) {
  tell("error", std::move(text));
  return static_cast<int>(kind);
}

void tell_note(std::string text) { tell("note", std::move(text)); }

int report_failure(const std::string& where) {
  const std::string before = where.empty() ? "" : where + ": ";
  try {
    throw;
  } catch (const formats::Error& error) {
    return fail(before + error.what(), error.kind());
  } catch (const std::bad_alloc&) {
    return fail(before + "out of memory; a smaller --memory or fewer --threads may help",
                ErrorKind::kSystem);
  } catch (const std::system_error& error) {
    return fail(before + error.what(), ErrorKind::kSystem);  // also what std::filesystem throws
  } catch (const std::exception& error) {
    return fail(before + "unexpected: " + error.what(), ErrorKind::kInvariant);
  } catch (...) {
    return fail(before + "unexpected: an exception that tells nothing", ErrorKind::kInvariant);
  }
}

}  // namespace cairn::pipeline
