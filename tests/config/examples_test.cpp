// SPDX-License-Identifier: Apache-2.0
// The examples are accepted unchanged, and any small slip in them is found at its place.
#include <algorithm>
#include <filesystem>
#include <sstream>
#include <vector>

#include "tests/config/config_support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace examples_test {

using namespace loopwarden;
using namespace loopwarden::config;
namespace fs = std::filesystem;

namespace {

const fs::path kExamples = fs::path(LOOPWARDEN_SOURCE_DIR) / "examples";

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    text += line;
    text += '\n';
  }
  return text;
}

struct Key {
  std::size_t line = 0;  // counted from 0
  std::size_t column = 0;
  std::size_t length = 0;
};

// Returns every `key:` of the text, also within {}; comments are skipped.
std::vector<Key> keys_of(const std::vector<std::string>& lines) {
  std::vector<Key> keys;
  for (std::size_t n = 0; n < lines.size(); ++n) {
    const std::string code = lines[n].substr(0, lines[n].find('#'));
    for (std::size_t colon = code.find(':'); colon != std::string::npos;
         colon = code.find(':', colon + 1)) {
      const bool ends_key = colon + 1 == code.size() || code[colon + 1] == ' ';
      std::size_t start = colon;
      while (start > 0 && (isalnum(static_cast<unsigned char>(code[start - 1])) != 0 ||
                           code[start - 1] == '_')) {
        --start;
      }
      if (ends_key && start < colon) keys.push_back({n, start, colon - start});
    }
  }
  return keys;
}

// Reads the text as a variation of this file.
std::vector<Diagnostic> diagnose(const fs::path& file, const std::string& text) {
  if (file.filename() == "loopwardend.yaml")
    return read_daemon_text(file.string(), text).diagnostics;
  if (file.parent_path().filename() == "models")
    return read_model_text(file.string(), text).diagnostics;
  const fs::path daemon_file = file.parent_path().parent_path() / "loopwardend.yaml";
  const auto daemon =
      read_daemon_text(daemon_file.string(), loopwarden::tests::read_file(daemon_file));
  REQUIRE(daemon);
  return read_loop_text(file.string(), text, *daemon).diagnostics;
}

// Returns the examples of the daemon. The tests of other programs read the others.
std::vector<fs::path> example_files() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(kExamples)) {
    const std::string folder = entry.path().parent_path().filename().string();
    const bool ours =
        entry.path().filename() == "loopwardend.yaml" || folder == "loops.d" || folder == "models";
    if (ours && entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// The packages create the users; a build host need not have them.
bool is_of_this_host(const Diagnostic& diagnostic) {
  return diagnostic.message.starts_with("there is no user 'loopwarden-feed' on this host") ||
         diagnostic.message.starts_with("there is no user 'loopwarden-opcua' on this host");
}

}  // namespace

TEST_CASE("Every example is accepted without a warning", "[config][examples]") {
  std::size_t directories = 0;
  for (const auto& entry : fs::directory_iterator(kExamples)) {
    if (!fs::is_directory(entry.path() / "loops.d")) continue;
    ++directories;
    const auto configuration = read_configuration(entry.path());
    INFO(entry.path() << "\n" << to_text(configuration.diagnostics));
    CHECK(configuration);
    CHECK(std::all_of(configuration.diagnostics.begin(), configuration.diagnostics.end(),
                      [](const Diagnostic& d) {
                        return d.level == Diagnostic::Level::note || is_of_this_host(d);
                      }));
  }
  CHECK(directories >= 5);
  CHECK(read_model_file(kExamples / "models" / "plant1.yaml"));
}

TEST_CASE("Every example can be copied by itself", "[config][examples]") {
  for (const auto& entry : fs::directory_iterator(kExamples)) {
    if (!fs::is_directory(entry.path() / "loops.d")) continue;
    const tests::TemporaryFolder elsewhere;
    fs::copy(entry.path(), elsewhere / "copy", fs::copy_options::recursive);
    const auto configuration = read_configuration(elsewhere / "copy");
    INFO(entry.path() << "\n" << to_text(configuration.diagnostics));
    CHECK(configuration);
    for (const auto& file : fs::recursive_directory_iterator(entry.path()))
      CHECK_FALSE(file.is_symlink());
  }
}

TEST_CASE("The example plant is the thesis's", "[config][examples]") {
  const auto model = read_model_file(kExamples / "models" / "plant1.yaml");
  REQUIRE(model);
  CHECK(model->process == plant::ProcessParameters{
                              .gain = 1.2264, .time_constant_s = 1.69376, .dead_time_s = 2.6256});
  CHECK(model->controller.pid.gains.kp == Approx(0.61145 / 1.75));
  CHECK(model->controller.pid.gains.ki == Approx(0.070013 / 1.75));
  CHECK(model->transmitter.resolution == 10.0 / 4096.0);
}

TEST_CASE("A misspelt key is found at its place, in every example", "[config][examples]") {
  for (const fs::path& file : example_files()) {
    const std::vector<std::string> lines = lines_of(loopwarden::tests::read_file(file));
    for (const Key& key : keys_of(lines)) {
      std::vector<std::string> changed = lines;
      changed[key.line].insert(key.column + key.length, "_x");
      const std::vector<Diagnostic> diagnostics = diagnose(file, joined(changed));
      // The name of a link or a feeder is free: only a loop that uses it detects the slip.
      const bool is_free_name =
          file.filename() == "loopwardend.yaml" &&
          std::all_of(diagnostics.begin(), diagnostics.end(), is_of_this_host);
      const Place place{static_cast<int>(key.line) + 1, static_cast<int>(key.column) + 1};
      const bool found =
          std::any_of(diagnostics.begin(), diagnostics.end(), [&](const Diagnostic& d) {
            return d.place == place && d.message.starts_with("unknown key");
          });
      INFO(file << ": " << changed[key.line] << "\n" << to_text(diagnostics));
      CHECK((found || is_free_name));
    }
  }
}

TEST_CASE("A line that is missing or doubled is found, or made no difference",
          "[config][examples]") {
  for (const fs::path& file : example_files()) {
    const std::vector<std::string> lines = lines_of(loopwarden::tests::read_file(file));
    for (std::size_t n = 0; n < lines.size(); ++n) {
      const std::string code = lines[n].substr(0, lines[n].find('#'));
      if (code.find_first_not_of(' ') == std::string::npos) continue;
      std::vector<std::string> without = lines;
      without.erase(without.begin() + static_cast<std::ptrdiff_t>(n));
      diagnose(file, joined(without));  // any message, but no crash

      const bool is_key =
          code.find(':') != std::string::npos && code.find("- {") == std::string::npos;
      if (!is_key) continue;
      std::vector<std::string> doubled = lines;
      doubled.insert(doubled.begin() + static_cast<std::ptrdiff_t>(n), lines[n]);
      const std::vector<Diagnostic> diagnostics = diagnose(file, joined(doubled));
      INFO(file << ": " << lines[n] << "\n" << to_text(diagnostics));
      CHECK(has_errors(diagnostics));
      CHECK(std::all_of(diagnostics.begin(), diagnostics.end(), [&](const Diagnostic& d) {
        return d.place.line >= 1 && d.place.line <= static_cast<int>(doubled.size()) + 1;
      }));
    }
  }
}

TEST_CASE("A value of another kind is found on its line, in every example", "[config][examples]") {
  for (const fs::path& file : example_files()) {
    const std::vector<std::string> lines = lines_of(loopwarden::tests::read_file(file));
    for (std::size_t n = 0; n < lines.size(); ++n) {
      const std::string code = lines[n].substr(0, lines[n].find('#'));
      const std::size_t colon = code.find(": ");
      if (colon == std::string::npos || code.find('{') != std::string::npos) continue;
      if (code.find_first_not_of(' ', colon + 1) == std::string::npos)
        continue;  // a mapping follows
      for (const char* value : {"{surprise: 1}", "[[]]", ".nan", "010", "''", "&a 1", "\"open"}) {
        std::vector<std::string> changed = lines;
        changed[n] = code.substr(0, colon + 2) + value;
        const std::vector<Diagnostic> diagnostics = diagnose(file, joined(changed));
        const bool is_text = code.find("description:") != std::string::npos ||
                             code.find("unit: ") != std::string::npos ||
                             code.find("_directory:") != std::string::npos ||
                             code.find("device:") != std::string::npos ||
                             code.find("channel:") != std::string::npos;
        const bool plain_word = value[0] == '.' || value[0] == '0';
        if (is_text && plain_word) continue;  // ordinary words
        const bool found = std::any_of(
            diagnostics.begin(), diagnostics.end(),
            [&](const Diagnostic& d) { return d.place.line == static_cast<int>(n) + 1; });
        INFO(file << ": " << changed[n] << "\n" << to_text(diagnostics));
        CHECK(found);
      }
    }
  }
}

}  // namespace examples_test
