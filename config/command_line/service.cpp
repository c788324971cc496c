// SPDX-License-Identifier: Apache-2.0
#include "config/command_line/service.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <sstream>

#include "config/command_line/unknown_word.hpp"
#include "base/exit_code.hpp"

namespace loopwarden::config {
namespace {

// The priority of a line, as in syslog(3).
class Priority final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& text) override {
    text.push_back(of(message.level));
  }
  std::unique_ptr<spdlog::custom_flag_formatter> clone() const override {
    return std::make_unique<Priority>();
  }

 private:
  static char of(spdlog::level::level_enum level) noexcept {
    switch (level) {
      case spdlog::level::critical: return '2';
      case spdlog::level::err: return '3';
      case spdlog::level::warn: return '4';
      case spdlog::level::info: return '6';
      default: return '7';
    }
  }
};

// systemd names the device and inode of its stream (systemd.exec(5), $JOURNAL_STREAM).
bool is_journal(int fd) {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat status {};
  return stream != nullptr && ::fstat(fd, &status) == 0 &&
         fmt::format("{}:{}", status.st_dev, status.st_ino) == stream;
}

}  // namespace

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
    // An arena for each thread would keep memory that the thread needed at its start only, and the
    // daemon would lock it.
    ::mallopt(M_ARENA_MAX, 1);
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

std::unique_ptr<spdlog::formatter> log_formatter() {
  if (!is_journal(STDERR_FILENO)) {
    return std::make_unique<spdlog::pattern_formatter>("%Y-%m-%dT%H:%M:%S.%eZ %l %v",
                                                       spdlog::pattern_time_type::utc);
  }
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<Priority>('*').set_pattern("<%*>%v");
  return formatter;
}

void log_to_stderr(const std::string& program, const std::string& level) {
  auto log = spdlog::stderr_logger_mt(program);
  log->set_formatter(log_formatter());
  spdlog::set_default_logger(std::move(log));
  spdlog::set_level(spdlog::level::from_str(level));
}

}  // namespace loopwarden::config
