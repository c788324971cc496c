// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "daemon/console/request.hpp"

namespace loopwarden::daemon::console {

// Returns the value of `word` in `words`. Throws RequestError with the text `known` for other
// words.
template <class Value>
Value meant_by(const std::string& word, const std::map<std::string, Value>& words,
               const char* known) {
  const auto value = words.find(word);
  if (value == words.end()) throw RequestError(known);
  return value->second;
}

}  // namespace loopwarden::daemon::console
