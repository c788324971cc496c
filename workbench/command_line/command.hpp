// SPDX-License-Identifier: Apache-2.0
// The commands of a program with their options: a small front to CLI11, whose header is included in this folder only.
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

// What a value must be; the help says so.
using Check = std::function<void(CLI::Option&)>;
Check between(int low, int high);
Check between(double low, double high);
Check above_zero();
Check not_below_zero();
Check one_of(std::vector<std::string> words);
Check existing_folder();
// `wrong` returns what is wrong with a value, empty: nothing. The help does not show it.
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
  // What verbs return goes to `exit_code`.
  explicit Command(CLI::App& app, int* exit_code = nullptr) : app_(&app), exit_code_(exit_code) {}

  // Of text, numbers, std::vector or std::optional of them. A name without -- is that of a positional argument.
  template <class T>
  Option option(const char* name, T& value, const std::string& meaning, const Check& check = {}) {
    return add(name, &value, meaning, check, Kind::plain);
  }
  template <class T>
  Option required(const char* name, T& value, const std::string& meaning, const Check& check = {}) {
    return add(name, &value, meaning, check, Kind::required);
  }
  // The help shows its default.
  template <class T>
  Option setting(const char* name, T& value, const std::string& meaning, const Check& check = {}) {
    return add(name, &value, meaning, check, Kind::shown);
  }
  Option flag(const char* name, bool& value, const std::string& meaning);
  // --socket, with the daemon of the package or LOOPWARDEN_SOCKET in its place.
  void socket(std::string& socket);

  void footer(const std::string& text);
  // The help lists what is added to the result under this heading.
  Command group(const char* heading) const;
  // A command of this command, with the options of both. Without one, this command runs itself.
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

// Ends the command as wrong usage: "... is required".
[[noreturn]] void require(const char* options);

template <class Options>
struct CommandWith {
  Command command;
  Options& options;  // live as long as the program
};

class Program {
 public:
  Program(const char* name, const char* meaning, const char* footer);
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  ~Program();

  // `work` returns the exit code. What it throws as CommandError or RecordError is printed and makes the exit code.
  template <class Options>
  CommandWith<Options> command(const char* name, const char* meaning, int (*work)(const Options&)) {
    const auto options = std::make_shared<Options>();
    return {add(name, meaning, [options, work] { return work(*options); }), *options};
  }
  // Runs the command that the words name, and returns its exit code.
  int run(int argc, char** argv);

 private:
  Command add(const char* name, const char* meaning, std::function<int()> work);

  std::unique_ptr<CLI::App> app_;
  int exit_code_ = 0;
};

}  // namespace loopwarden::workbench
