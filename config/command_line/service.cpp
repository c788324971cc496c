// SPDX-License-Identifier: Apache-2.0
#include "config/command_line/service.hpp"

#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <exception>
#include <sstream>

#include "config/command_line/unknown_word.hpp"
#include "base/exit_code.hpp"

namespace loopwarden::config {

int say(const CLI::App& app, const CLI::ParseError& what) {
  // CLI11 prints by streams of its own, whose failures nobody sees.
  std::ostringstream out;
  std::ostringstream error;
  const int code = app.exit(what, out, error);
  fmt::print("{}", out.str());
  fmt::print(stderr, "{}", error.str());
  return code == 0 ? kExitOk : kExitUsage;
}

int run_service(CLI::App& app, int argc, char** argv, const std::function<int()>& run) {
  const std::string unknown = unknown_word(app, {argv + 1, argv + argc});
  if (!unknown.empty()) {
    fmt::print(stderr, "{}: {}\n", app.get_name(), unknown);
    return kExitUsage;
  }
  try {
    app.parse(argc, argv);
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
