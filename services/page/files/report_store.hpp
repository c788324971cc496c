// SPDX-License-Identifier: Apache-2.0
// Reports and evidence below the daemon's state directory.
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
  std::string id;    // of its path, the same as long as it lies there
  std::string kind;  // gap, training, commissioning, survey, diagnosis, explanation or other
  std::string title;
  std::int64_t utc_ms = 0;  // when it was written
  std::uintmax_t bytes = 0;
  std::string loop;                // empty: of none, or of several
  std::vector<std::string> parts;  // its path below the folder
};

// Any thread. Reports are in an index, which one caller at a time makes anew by a walk through the state directory, at most every few
// seconds; all others get the index that is there.
class ReportStore {
 public:
  // `fresh`: how long an index lasts; one that took long to make lasts longer, so that walks take a tenth of one thread's time.
  explicit ReportStore(std::filesystem::path state_directory,
                       std::chrono::milliseconds fresh = std::chrono::seconds(5))
      : folder_(std::move(state_directory)), fresh_(fresh) {}

  using List = std::shared_ptr<const std::vector<Report>>;
  // Every *.html, at most kMost, newest first.
  List reports();

  // name() and read() know the reports of the index and never walk for one that is not in it. The report's file name; nullopt if
  // there is none of this id.
  std::optional<std::string> name(const std::string& id);

  struct Content {
    std::string type;
    std::string bytes;
  };
  // A file below the report's folder, by its path there. A page has its stylesheets and scripts inside.
  std::optional<Content> read(const std::string& id, const std::vector<std::string>& below);

  // Files of a piece of evidence, by name; it may lie within another one's folder.
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

  std::mutex walking_;  // held by who walks
  // Of who walks.
  std::map<std::string, Known> known_;  // by path; a title is read once

  std::mutex mutex_;
  List index_;  // null: never made
  Clock::time_point due_;
};

}  // namespace loopwarden::page::files
