// SPDX-License-Identifier: Apache-2.0
// Reports and evidence below the daemon's state directory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "page/files/folder.hpp"

namespace loopwarden::page::files {

struct Report {
  std::string id;    // of its path, the same as long as it lies there
  std::string kind;  // gap, training, commissioning, survey, explanation or other
  std::string title;
  std::int64_t utc_ms = 0;  // when it was written
  std::uintmax_t bytes = 0;
  std::string loop;                // empty: of none, or of several
  std::vector<std::string> parts;  // its path below the folder
};

class ReportShelf {
 public:
  explicit ReportShelf(std::filesystem::path state_directory)
      : folder_(std::move(state_directory)) {}

  // Every *.html, at most kMost, newest first. Any thread.
  std::vector<Report> reports();

  // The report's file name; nothing where there is none of this id.
  std::optional<std::string> name(const std::string& id);

  struct Content {
    std::string type;
    std::string bytes;
  };
  // A file below the report's folder, by its path there. A page has its stylesheets and scripts inside.
  std::optional<Content> read(const std::string& id, const std::vector<std::string>& below);

  // Files of a piece of evidence, by name.
  std::vector<std::string> evidence_files(const std::string& id) const;
  std::optional<std::string> evidence_file(const std::string& id, const std::string& name) const;
  std::filesystem::path evidence_folder(const std::string& id) const;

  static constexpr std::size_t kMost = 5000;

 private:
  struct Known {
    std::int64_t utc_ms;
    std::uintmax_t bytes;
    Report report;
  };
  std::optional<std::vector<std::string>> parts_of_report(const std::string& id);
  Report look_at(const std::filesystem::path& path, std::int64_t utc_ms, std::uintmax_t bytes);

  Folder folder_;
  std::mutex mutex_;
  std::map<std::string, Known> known_;  // by path; a title is read once
};

}  // namespace loopwarden::page::files
