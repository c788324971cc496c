// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/command.hpp"

#include <CLI/CLI.hpp>

#include <utility>

#include "base/exit_code.hpp"
#include "record/record_csv.hpp"
#include "workbench/command_line/command_line.hpp"
#include "workbench/command_line/program.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/live/daemon_client.hpp"

namespace loopwarden::workbench {
namespace {

Check valid(const CLI::Validator& validator) {
  return [validator](CLI::Option& option) { option.check(validator); };
}

}  // namespace

Check between(int low, int high) { return valid(CLI::Range(low, high)); }
Check between(double low, double high) { return valid(CLI::Range(low, high)); }
Check above_zero() { return valid(CLI::PositiveNumber); }
Check not_below_zero() { return valid(CLI::NonNegativeNumber); }
Check one_of(std::vector<std::string> words) { return valid(CLI::IsMember(std::move(words))); }
Check existing_folder() { return valid(CLI::ExistingDirectory); }
Check checked(std::function<std::string(const std::string&)> wrong) {
  return [wrong = std::move(wrong)](CLI::Option& option) { option.check(wrong); };
}

Option& Option::needs(const Option& other) {
  option_->needs(other.option_);
  return *this;
}

Option& Option::excludes(const Option& other) {
  option_->excludes(other.option_);
  return *this;
}

Option& Option::takes(int values) {
  option_->expected(values);
  return *this;
}

Option& Option::delimiter(char between_values) {
  option_->delimiter(between_values);
  return *this;
}

Option Command::add(const char* name, Value value, const std::string& meaning, const Check& check,
                    Kind kind) {
  CLI::Option& option =
      *std::visit([&](auto* target) { return app_->add_option(name, *target, meaning); }, value);
  if (kind == Kind::required) option.required();
  if (kind == Kind::shown) option.capture_default_str();
  if (check) check(option);
  if (!group_.empty()) option.group(group_);
  return Option(option);
}

Option Command::flag(const char* name, bool& value, const std::string& meaning) {
  return Option(*app_->add_flag(name, value, meaning));
}

void Command::socket(std::string& socket) {
  socket = DaemonClient::kDefaultSocket;
  app_->add_option("--socket", socket, "the daemon's control socket")
      ->envname("LOOPWARDEN_SOCKET")
      ->capture_default_str();
}

void Command::footer(const std::string& text) { app_->footer(text); }

Command Command::group(const char* heading) const {
  Command same = *this;
  same.group_ = heading;
  return same;
}

Command Command::verb(const char* name, const char* meaning, std::function<int()> work) {
  app_->require_subcommand(0, 1);
  app_->fallthrough();
  CLI::App* verb = app_->add_subcommand(name, meaning);
  verb->fallthrough();
  verb->callback([exit_code = exit_code_, work = std::move(work)] { *exit_code = work(); });
  return Command(*verb, exit_code_);
}

void require(const char* options) { throw CLI::RequiredError(options); }

Program::Program(const char* name, const char* meaning, const char* footer)
    : app_(std::make_unique<CLI::App>(meaning, name)) {
  app_->set_version_flag("--version,-V", LOOPWARDEN_VERSION);
  app_->footer(footer);
}

Program::~Program() = default;

Command Program::add(const char* name, const char* meaning, std::function<int()> work) {
  CLI::App* sub = app_->add_subcommand(name, meaning);
  sub->callback([this, sub, work = std::move(work)] {
    if (!sub->get_subcommands().empty()) return;
    try {
      exit_code_ = work();
    } catch (const record::RecordError& e) {
      throw CommandError(e.kind() == record::RecordError::Kind::io ? kExitIo : kExitData, e.what());
    }
  });
  return Command(*sub, &exit_code_);
}

int Program::run(int argc, char** argv) {
  look_in_package(*app_);
  return run_program(*app_, exit_code_, argc, argv);
}

}  // namespace loopwarden::workbench
