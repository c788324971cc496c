// SPDX-License-Identifier: Apache-2.0
// docs/project/sparkplug-conformance.md names a test for each statement of the specification, for
// edge and host. The test must exist.
#include <catch2/catch.hpp>
#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace statements_test {

namespace fs = std::filesystem;
using loopwarden::tests::read_file;

// Returns the text of the literal after the quote at `begin`, with the literals on following lines.
std::string literal_at(const std::string& text, std::size_t begin) {
  std::string whole;
  for (;;) {
    const std::size_t end = text.find('"', begin);
    whole += text.substr(begin, end - begin);
    begin = text.find_first_not_of(" \n", end + 1);
    if (begin == std::string::npos || text[begin] != '"') return whole;
    ++begin;
  }
}

std::set<std::string> test_names() {
  constexpr std::string_view kStart = "TEST_CASE(";
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(LOOPWARDEN_SOURCE_DIR "/tests")) {
    if (!entry.path().string().ends_with("_test.cpp")) continue;
    const std::string text = read_file(entry.path());
    for (std::size_t at = text.find(kStart); at != std::string::npos;
         at = text.find(kStart, at + 1)) {
      names.insert(literal_at(text, text.find('"', at) + 1));
    }
  }
  return names;
}

// Returns the texts in backquotes in the last column of a line.
std::vector<std::string> quoted_in_last_column(const std::string& line) {
  const std::size_t end = line.rfind(" |");
  const std::size_t begin = line.rfind("| ", end - 1);
  std::istringstream column(line.substr(begin, end - begin));
  std::vector<std::string> parts;
  for (std::string part; std::getline(column, part, '`');) parts.push_back(part);
  std::vector<std::string> quoted;
  for (std::size_t i = 1; i < parts.size(); i += 2) quoted.push_back(parts[i]);
  return quoted;
}

// Returns the number of tests named in a page. All of them must exist.
int tests_named(const std::string& page) {
  static const std::set<std::string> names = test_names();
  std::istringstream lines(page);
  int found = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| `")) continue;
    for (const std::string& name : quoted_in_last_column(line)) {
      if (name.find(' ') == std::string::npos) continue;  // a key or a metric
      INFO(name);
      CHECK(names.contains(name));
      ++found;
    }
  }
  return found;
}

TEST_CASE("every test named in the tables of Sparkplug's statements exists",
          "[sparkplug][statements]") {
  const std::string page =
      read_file(LOOPWARDEN_SOURCE_DIR "/docs/project/sparkplug-conformance.md");
  const std::size_t host = page.find("## Statements of a host");
  REQUIRE(host != std::string::npos);
  CHECK(tests_named(page.substr(0, host)) > 25);
  CHECK(tests_named(page.substr(host)) > 8);
}

}  // namespace statements_test
