// SPDX-License-Identifier: Apache-2.0
// The readers' description of their keys: the source of docs/reference/configuration.md. The build
// makes loopwardend.yaml(5) from it.
#pragma once

#include <string>
#include <vector>

namespace loopwarden::config {

struct KeyDescription {
  std::string path;      // such as controller.output.range
  std::string value;     // permitted values, with unit and range
  std::string fallback;  // `required`, or the default
  std::string meaning;
};

// The keys of one kind of file, in the order in which its reader asks for them.
class KeyReference {
 public:
  // Adds a key. If a path is added twice, the first description is kept.
  void add(KeyDescription description);
  const std::vector<KeyDescription>& keys() const noexcept { return keys_; }

 private:
  std::vector<KeyDescription> keys_;
};

// Returns a Markdown table for each mapping.
std::string to_markdown(const KeyReference& reference);

// Returns the whole text of docs/reference/configuration.md.
std::string describe_configuration();

}  // namespace loopwarden::config
