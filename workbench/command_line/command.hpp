// SPDX-License-Identifier: Apache-2.0
// The commands of a program and their options: a small wrapper of CLI11. Only this folder includes
// the header of CLI11.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace loopwarden::workbench {

// A condition that a value must meet. The help shows it.
using Check = std::function<void(CLI::Option&)>;
Check between(int low, int high);
Check between(double low, double high);
Check above_zero();
Check not_below_zero();
Check one_of(std::vector<std::string> words);
Check existing_folder();
// Accepts a value if `wrong` returns an empty text, otherwise rejects it with that text as the
// error. The help does not show this check.
Check checked(std::function<std::string(const std::string&)> wrong);

class Option {
 public:
  explicit Option(CLI::Option& option) : option_(&option) {}
  Option& needs(const Option& other);
  Option& excludes(const Option& other);
  Option& takes(int values);
  Option& delimiter(char between_values);

 private:
  CLI::Option* option_;
};

class Command {
 public:
  // `exit_code` receives the values that verbs return.
  explicit Command(CLI::App& app, int* exit_code = nullptr) : app_(&app), exit_code_(exit_code) {}

  // Adds an option for a text, a number, or a std::vector or std::optional of them. A name without
  // -- is a positional argument.
  template <class T>
  Option option(const char* name, T& value, const std::string& meaning, const Check& check = {}) {
    return add(name, &value, meaning, check, Kind::plain);
  }
  template <class T>
  Option required(const char* name, T& value, const std::string& meaning, const Check& check = {}) {
    return add(name, &value, meaning, check, Kind::required);
  }
  // Adds an option whose default appears in the help.
  template <class T>
  Option setting(const char* name, T& value, const std::string& meaning, const Check& check = {}) {
    return add(name, &value, meaning, check, Kind::shown);
  }
  Option flag(const char* name, bool& value, const std::string& meaning);
  // Adds --socket. Its default is LOOPWARDEN_SOCKET, or the socket of the packaged daemon.
  void socket(std::string& socket);

  void footer(const std::string& text);
  // Returns a command whose options appear under this heading of the help.
  Command group(const char* heading) const;
  // Adds a subcommand that accepts the options of both. Without a verb, this command runs itself.
  Command verb(const char* name, const char* meaning, std::function<int()> work);

 private:
  enum class Kind { plain, required, shown };
  using Value =
      std::variant<std::string*, std::vector<std::string>*, std::optional<std::string>*, double*,
                   std::vector<double>*, std::optional<double>*, int*, unsigned*, std::uint64_t*,
                   std::vector<std::uint64_t>*, std::optional<std::uint64_t>*>;
  Option add(const char* name, Value value, const std::string& meaning, const Check& check,
             Kind kind);

  CLI::App* app_;
  int* exit_code_;
  std::string group_;
};

// Ends the command with a usage error: "... is required".
[[noreturn]] void require(const char* options);

template <class Options>
struct CommandWith {
  Command command;
  Options& options;  // valid until the program ends
};

class Program {
 public:
  Program(const char* name, const char* meaning, const char* footer);
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  ~Program();

  // Adds a command. `work` returns the exit code. A CommandError or RecordError that it throws is
  // printed and sets the exit code.
  template <class Options>
  CommandWith<Options> command(const char* name, const char* meaning, int (*work)(const Options&)) {
    const auto options = std::make_shared<Options>();
    return {add(name, meaning, [options, work] { return work(*options); }), *options};
  }
  // Runs the command that the arguments name. Returns its exit code.
  int run(int argc, char** argv);

 private:
  Command add(const char* name, const char* meaning, std::function<int()> work);

  std::unique_ptr<CLI::App> app_;
  int exit_code_ = 0;
};

}  // namespace loopwarden::workbench
