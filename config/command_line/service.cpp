// SPDX-License-Identifier: Apache-2.0
#include "config/command_line/service.hpp"

#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <sstream>

#include "config/command_line/unknown_word.hpp"
#include "base/exit_code.hpp"

namespace loopwarden::config {

int say(const CLI::App& app, const CLI::ParseError& what) {
  // CLI11 prints to these buffers, because it ignores failures of its output streams.
  std::ostringstream out;
  std::ostringstream error;
  const int code = app.exit(what, out, error);
  fmt::print("{}", out.str());
  fmt::print(stderr, "{}", error.str());
  return code == 0 ? kExitOk : kExitUsage;
}

std::vector<std::string> in_options(std::vector<std::string> words) {
  if (words.empty()) return words;
  if (words.front() == "version") words.front() = "--version";
  if (words.front() == "help") {
    words.erase(words.begin());
    words.emplace_back("--help");
  }
  return words;
}

int run_service(CLI::App& app, std::vector<std::string> words, const std::function<int()>& run) {
  const std::string unknown = unknown_word(app, words);
  if (!unknown.empty()) {
    fmt::print(stderr, "{}: {}\n", app.get_name(), unknown);
    return kExitUsage;
  }
  try {
    std::reverse(words.begin(), words.end());  // CLI11 expects the words in reverse order
    app.parse(words);
    return run();
  } catch (const CLI::ParseError& e) {
    return say(app, e);
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}: {}\n", app.get_name(), e.what());
    return kExitIo;
  }
}

void log_to_stderr(const std::string& program, const std::string& level) {
  auto log = spdlog::stderr_logger_mt(program);
  log->set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %l %v", spdlog::pattern_time_type::utc);
  spdlog::set_default_logger(std::move(log));
  spdlog::set_level(spdlog::level::from_str(level));
}

}  // namespace loopwarden::config
