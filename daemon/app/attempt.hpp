// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <spdlog/spdlog.h>

#include <exception>

namespace loopwarden::daemon {

// What goes wrong beside the loops, such as memory that can't be had, must not end them. False if it did.
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
