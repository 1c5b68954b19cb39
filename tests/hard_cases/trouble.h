// What the tests of trouble share: files and moments at which other converters lost points, crashed or hung. Each test tells
// what the others did and what Cairn answered, for the page that scripts/hard_cases.py prints.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tests/end_to_end/program_test.h"

namespace cairn::test {

class TroubleTest : public ProgramTest {
 protected:
  using Bytes = std::map<std::string, std::string>;

  /// Runs a command without progress. A crash or a hang is a failure of the test.
  Outcome run(const std::string& command, const std::vector<std::string>& arguments);
  /// The same with `build`, to this dataset.
  Outcome build_at(const std::filesystem::path& dataset, const std::vector<std::string>& arguments);

  /// The three files that make up a dataset.
  static Bytes read(const std::filesystem::path& dataset);

  /// One error line on stderr, which is returned as it is shown: without the folder of the test.
  std::string error_of(const Outcome& outcome) const;

  /// What `info` tells, after it was held to `verify` and to its promise of uniformity: leaves differ by at most one point,
  /// and an inner node holds exactly as many as any other.
  nlohmann::json expect_sound(const std::vector<std::string>& verify_flags = {});

  /// A row of the page.
  static void tell(const std::string& trouble, const std::string& others,
                   const std::string& answer);
};

}  // namespace cairn::test
