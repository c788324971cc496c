// SPDX-License-Identifier: Apache-2.0
// The site's own files, in memory, compressed once.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "services/net/http/message.hpp"

namespace loopwarden::http {

class Assets {
 public:
  Assets() = default;
  // From a folder, for work on the site.
  explicit Assets(const std::filesystem::path& folder);

  // `path` below the site, such as index.html.
  void add(const std::string& path, std::string bytes);

  // Status 404 if there is no such file, 304 if the client has it.
  Response answer(const Request& request) const;

 private:
  struct Asset {
    std::string type;
    std::string tag;  // the ETag, with its quotes
    std::shared_ptr<const std::string> plain;
    std::shared_ptr<const std::string> packed;  // null: gzip makes it no smaller
  };

  std::map<std::string, Asset> assets_;
};

}  // namespace loopwarden::http
