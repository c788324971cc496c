// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include "config/command_line/service.hpp"
#include "config/command_line/unknown_word.hpp"
#include "base/exit_code.hpp"
#include "workbench/command_line/command_line.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/live/daemon_client.hpp"

namespace loopwarden::workbench {

int run_program(CLI::App& app, const int& exit_code, int argc, char** argv) {
  app.require_subcommand(1);
  refuse_negative_counts(app);
  std::vector<std::string> words = config::in_options({argv + 1, argv + argc});
  const std::string unknown = config::unknown_word(app, words);
  if (!unknown.empty()) {
    fmt::print(stderr, "{}: {}\n", app.get_name(), unknown);
    return kExitUsage;
  }
  try {
    std::reverse(words.begin(), words.end());  // the order that CLI11 expects
    app.parse(words);
  } catch (const CLI::ParseError& e) {
    return config::say(app, e);
  } catch (const CommandError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return e.exit_code();
  } catch (const DaemonRefused& e) {
    fmt::print(stderr, "{}: {}\n", app.get_name(), e.what());
    return e.exit_code();
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "{}: the memory does not suffice; a shorter stretch takes less\n",
               app.get_name());
    return kExitIo;
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}: {}\n", app.get_name(), e.what());
    return kExitIo;
  }
  return exit_code;
}

}  // namespace loopwarden::workbench
