// SPDX-License-Identifier: Apache-2.0
#include "config/command_line/unknown_word.hpp"

#include <fmt/format.h>

#include <cctype>

#include "config/diagnostic.hpp"

namespace loopwarden::config {
namespace {

bool is_number(const std::string& word) {
  return word.size() > 1 && (std::isdigit(static_cast<unsigned char>(word[1])) != 0 ||
                             word[1] == '.' || word == "-inf" || word == "-nan");
}

const CLI::App* find_command(const CLI::App& app, const std::string& word) {
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (sub->get_name() == word) return sub;
  }
  return nullptr;
}

std::vector<std::string> commands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(sub->get_name());
  }
  return names;
}

// Returns the option of `app`, or of its parent commands if the command lets options fall through
// to them.
const CLI::Option* find_option(const CLI::App* app, const std::string& name) {
  for (; app != nullptr; app = app->get_fallthrough() ? app->get_parent() : nullptr) {
    if (const CLI::Option* option = app->get_option_no_throw(name)) return option;
  }
  return nullptr;
}

std::vector<std::string> options_of(const CLI::App* app) {
  std::vector<std::string> names;
  for (; app != nullptr; app = app->get_fallthrough() ? app->get_parent() : nullptr) {
    for (const CLI::Option* option : app->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  }
  return names;
}

}  // namespace

std::string unknown_word(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* command = &app;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "--") break;
    if (word.size() < 2 || word[0] != '-' || is_number(word)) {
      const CLI::App* next = find_command(*command, word);
      const std::vector<std::string> commands = commands_of(app);
      if (next == nullptr && command == &app && !commands.empty()) {
        return fmt::format("unknown command '{}'{}", quotable(word), suggestion(word, commands));
      }
      if (next != nullptr) command = next;
      continue;
    }
    const std::size_t equals = word.find('=');
    const std::string name = word.substr(0, equals);
    const CLI::Option* option = find_option(command, word[1] == '-' ? name : word.substr(0, 2));
    if (option == nullptr) {
      return fmt::format("unknown option '{}'{}{}", quotable(name),
                         command == &app ? "" : " of " + command->get_name(),
                         suggestion(name, options_of(command)));
    }
    // The option's value may look like anything.
    if (option->get_expected_min() > 0 && equals == std::string::npos) ++i;
  }
  return {};
}

}  // namespace loopwarden::config
