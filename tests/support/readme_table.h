// Tables of the README, which tests hold the program to.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

namespace cairn::test {

/// The rows of the first table below a heading ("## Progress for programs") of a Markdown file, without the two of its
/// head; cells trimmed.
inline std::vector<std::vector<std::string>> markdown_table(const std::string& path,
                                                            const std::string& heading) {
  std::ifstream in(path);
  std::string line;
  while (std::getline(in, line) && line != heading) continue;
  std::vector<std::vector<std::string>> rows;
  int table_line = 0;
  while (std::getline(in, line)) {
    if (!line.starts_with("|")) {
      if (table_line > 0 || line.starts_with("#")) break;
      continue;
    }
    if (++table_line <= 2) continue;
    std::vector<std::string> cells;
    for (std::size_t begin = 1; begin < line.size();) {
      const std::size_t end = line.find('|', begin);
      std::string cell = line.substr(begin, end - begin);
      cell.erase(0, cell.find_first_not_of(' '));
      cell.erase(cell.find_last_not_of(' ') + 1);
      cells.push_back(cell);
      begin = end == std::string::npos ? line.size() : end + 1;
    }
    rows.push_back(cells);
  }
  return rows;
}

}  // namespace cairn::test
