// SPDX-License-Identifier: Apache-2.0
// Which values of which feeder a loop reads that another controller runs.
#pragma once

#include <optional>
#include <string>

#include "hal/contract/loop_source.hpp"

namespace loopwarden::hal::feed {

// A feeder of loopwardend.yaml, and the name that it gives the value.
struct FeedName {
  std::string feeder;
  std::string name;

  friend bool operator==(const FeedName&, const FeedName&) = default;
};

struct FeedSettings {
  FeedName process_variable{};  // PV units
  FeedName output{};            // CO units
  std::optional<FeedName> set_point{};
  std::optional<FeedName> stem{};  // CO units
  std::optional<FeedName> mode{};
  ModeValues mode_values{};

  friend bool operator==(const FeedSettings&, const FeedSettings&) = default;
};

}  // namespace loopwarden::hal::feed
