// SPDX-License-Identifier: Apache-2.0
// Provides reports and evidence below the daemon's state directory.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "services/page/files/folder.hpp"

namespace loopwarden::page::files {

struct Report {
  std::string id;  // of its path: the same as long as the file stays there
  std::string
      kind;  // gap, training, commissioning, survey, diagnosis, receipt, explanation or other
  std::string title;
  std::int64_t utc_ms = 0;  // when it was written
  std::uintmax_t bytes = 0;
  std::string loop;                // empty: no loop, or several
  std::vector<std::string> parts;  // its path below the folder
};

// Finds reports by an index, which one caller at a time renews by a walk through the state
// directory, at most every few seconds. Meanwhile all others get the existing index. Any thread.
class ReportStore {
 public:
  // `fresh`: lifetime of an index. An index that took long to make lives longer, so that walks take
  // a tenth of one thread's time.
  explicit ReportStore(std::filesystem::path state_directory,
                       std::chrono::milliseconds fresh = std::chrono::seconds(5))
      : folder_(std::move(state_directory)), fresh_(fresh) {}

  using List = std::shared_ptr<const std::vector<Report>>;
  // Returns every *.html, at most kMost, newest first.
  List reports();

  // Returns the report's file name; nullopt for an unknown id. name() and read() search only the
  // existing index and never walk.
  std::optional<std::string> name(const std::string& id);

  struct Content {
    std::string type;
    std::string bytes;
  };
  // Returns a file below the report's folder, by its path there. Pages include styles and scripts.
  std::optional<Content> read(const std::string& id, const std::vector<std::string>& below);

  // Return files of a piece of evidence, by name. Its folder may be inside another one's.
  std::vector<std::string> evidence_files(const std::string& id) const;
  std::optional<std::string> evidence_file(const std::string& id, const std::string& name) const;
  std::filesystem::path evidence_folder(const std::string& id) const;

  static constexpr std::size_t kMost = 5000;

 private:
  std::vector<std::string> evidence_parts(const std::string& id) const;
  struct Known {
    std::int64_t utc_ms;
    std::uintmax_t bytes;
    Report report;
  };
  using Clock = std::chrono::steady_clock;
  std::optional<std::vector<std::string>> parts_of_report(const std::string& id);
  Report look_at(const std::filesystem::path& path, std::int64_t utc_ms, std::uintmax_t bytes);
  void walk();
  void look_into(const std::filesystem::directory_entry& entry,
                 std::map<std::string, Known>& found);

  Folder folder_;
  std::chrono::milliseconds fresh_;

  std::mutex walking_;  // held by the walking thread
  // Used only by the walking thread.
  std::map<std::string, Known> known_;  // by path; a title is read once

  std::mutex mutex_;
  List index_;  // null: not made yet
  Clock::time_point due_;
};

}  // namespace loopwarden::page::files
