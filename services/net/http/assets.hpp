// SPDX-License-Identifier: Apache-2.0
// Holds the static files of the site in memory, compressed once.
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
  // Reads a folder, for development of the site.
  explicit Assets(const std::filesystem::path& folder);

  // Adds a file. `path` is relative to the site, such as index.html.
  void add(const std::string& path, std::string bytes);

  // Returns the file. Status 404 if it does not exist, 304 if the client has the present version.
  Response answer(const Request& request) const;

 private:
  struct Asset {
    std::string type;
    std::string tag;  // the ETag, with quotes
    std::shared_ptr<const std::string> plain;
    std::shared_ptr<const std::string> packed;  // null: gzip does not make it smaller
  };

  std::map<std::string, Asset> assets_;
};

}  // namespace loopwarden::http
