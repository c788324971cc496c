// SPDX-License-Identifier: Apache-2.0
// A second copy of what the alarms remember, for the day on which the journal's file is damaged: a small
// text file of one checksum and one JSON object, replaced whole.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "daemon/journal/journal_entry.hpp"

namespace loopwarden::daemon::journal {

class AlarmStateFile {
 public:
  explicit AlarmStateFile(std::filesystem::path path) : path_(std::move(path)) {}

  // False, with the reason in `why`, if the disk refused; the old copy is then still there.
  bool save(const AlarmStates& states, std::string& why) const;
  // Nothing if there is no file or it is damaged; `why` is then set for the latter.
  std::optional<AlarmStates> load(std::string& why) const;

 private:
  std::filesystem::path path_;
};

}  // namespace loopwarden::daemon::journal
