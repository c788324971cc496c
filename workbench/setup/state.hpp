// SPDX-License-Identifier: Apache-2.0
// How far a setup has come: a JSON file that each answer and each step is kept in, so that it goes on after whatever ended
// it. The daemon reads it for the page (daemon/console/setups.hpp).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "base/file.hpp"

namespace loopwarden::workbench::setup {

class State {
 public:
  // Of the file, or of a setup that begins. Throws CommandError where it can't be read as such.
  explicit State(std::filesystem::path file);

  const std::map<std::string, std::string>& answers() const noexcept { return answers_; }
  void answer(const std::string& id, const std::string& answer);
  // done, left, or empty: not yet.
  std::string step(const std::string& name) const;
  void begin_step(const std::string& name);
  void set_step(const std::string& name, const std::string& state);
  // What a step found, for a later one and for people.
  std::string found(const std::string& name) const;
  void set_found(const std::string& name, const std::string& what);
  // A step that is to be done again asks its questions anew; what comes of them is written and looked at anew as well.
  void forget(const std::string& step);

  bool is_new() const noexcept { return steps_.empty(); }
  const std::filesystem::path& file() const noexcept { return file_; }

 private:
  void save();

  std::filesystem::path file_;
  // Holds a lock for writing on the file, which tells that a setup is at it and ends with the process.
  base::File held_;
  std::optional<std::int64_t> begun_ms_;  // UTC
  std::int64_t now_at_since_ms_ = 0;      // UTC
  std::string now_at_;                    // step; empty: none
  std::map<std::string, std::string> answers_, steps_, found_;
};

}  // namespace loopwarden::workbench::setup
