// SPDX-License-Identifier: Apache-2.0
// What the readers say about their keys: the source of docs/configuration.md, of which the build makes
// loopwardend.yaml(5).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::config {

struct KeyDescription {
  std::string path;      // such as controller.output.range
  std::string value;     // what may stand there, with unit and range
  std::string fallback;  // `required`, or what holds without the key
  std::string meaning;
};

// The keys of one kind of file, in the order in which its reader asks for them.
class KeyReference {
 public:
  // The first description of a path counts.
  void add(KeyDescription description);
  const std::vector<KeyDescription>& keys() const noexcept { return keys_; }

 private:
  std::vector<KeyDescription> keys_;
};

// A Markdown table for each mapping.
std::string to_markdown(const KeyReference& reference);

// The whole of docs/configuration.md.
std::string describe_configuration();

}  // namespace loopwarden::config
