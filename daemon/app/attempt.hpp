// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <spdlog/spdlog.h>

#include <exception>

namespace loopwarden::daemon {

// Runs a step that must not end the loops if it fails, for example for lack of memory. Returns
// false if the step failed.
template <class Step>
bool attempt(const char* what, Step step) {
  try {
    step();
    return true;
  } catch (const std::exception& e) {
    spdlog::error("{}: {}; the loops run on", what, e.what());
    return false;
  }
}

}  // namespace loopwarden::daemon
