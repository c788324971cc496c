// SPDX-License-Identifier: Apache-2.0
// How far a setup has come: a JSON file that each answer and each step is kept in, so that it goes on after whatever ended
// it.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace loopwarden::workbench::setup {

class State {
 public:
  // Of the file, or of a setup that begins. Throws CommandError where it can't be read as such.
  explicit State(std::filesystem::path file);

  const std::map<std::string, std::string>& answers() const noexcept { return answers_; }
  void answer(const std::string& id, const std::string& answer);
  // done, left, or empty: not yet.
  std::string step(const std::string& name) const;
  void set_step(const std::string& name, const std::string& state);
  // What a step found, for a later one and for people.
  std::string found(const std::string& name) const;
  void set_found(const std::string& name, const std::string& what);
  // A step that is to be done again asks its questions anew; what comes of them is written and looked at anew as well.
  void forget(const std::string& step);

  bool is_new() const noexcept { return steps_.empty(); }
  const std::filesystem::path& file() const noexcept { return file_; }

 private:
  void save() const;

  std::filesystem::path file_;
  std::map<std::string, std::string> answers_, steps_, found_;
};

}  // namespace loopwarden::workbench::setup
