// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <sstream>
#include <string>
#include <vector>

#include "hal/os/exit_code.hpp"
#include "workbench/command_line/command_line.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/live/daemon_client.hpp"

namespace loopwarden::workbench {
namespace {

// Wrong usage, --help and --version. CLI11 prints by streams of its own, whose failures nobody sees.
int say(const CLI::App& app, const CLI::ParseError& what) {
  std::ostringstream out;
  std::ostringstream error;
  const int code = app.exit(what, out, error);
  fmt::print("{}", out.str());
  fmt::print(stderr, "{}", error.str());
  return code == 0 ? kExitOk : kExitUsage;
}

}  // namespace

int run_program(CLI::App& app, const int& exit_code, int argc, char** argv) {
  app.require_subcommand(1);
  refuse_negative_counts(app);
  std::vector<std::string> words = in_options({argv + 1, argv + argc});
  const std::string unknown = unknown_word(app, words);
  if (!unknown.empty()) {
    fmt::print(stderr, "{}: {}\n", app.get_name(), unknown);
    return kExitUsage;
  }
  try {
    std::reverse(words.begin(), words.end());  // as CLI11 takes them
    app.parse(words);
  } catch (const CLI::ParseError& e) {
    return say(app, e);
  } catch (const CommandError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return e.exit_code();
  } catch (const DaemonRefused& e) {
    fmt::print(stderr, "{}: {}\n", app.get_name(), e.what());
    return e.exit_code();
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}: {}\n", app.get_name(), e.what());
    return kExitIo;
  }
  return exit_code;
}

}  // namespace loopwarden::workbench
