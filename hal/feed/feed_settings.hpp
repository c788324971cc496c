// SPDX-License-Identifier: Apache-2.0
// The values of a feeder that make up a loop of another controller.
#pragma once

#include <optional>
#include <string>

#include "hal/contract/loop_source.hpp"

namespace loopwarden::hal::feed {

// A feeder of loopwardend.yaml, and its name for the value.
struct FeedName {
  std::string feeder;
  std::string name;

  friend bool operator==(const FeedName&, const FeedName&) = default;
};

// A number that a loop reads: value = fed * scale + offset.
struct FeedPoint {
  FeedName name{};
  double scale = 1.0;   // finite, not 0
  double offset = 0.0;  // finite

  friend bool operator==(const FeedPoint&, const FeedPoint&) = default;
};

struct FeedSettings {
  FeedPoint process_variable{};  // PV units
  FeedPoint output{};            // CO units
  std::optional<FeedPoint> set_point{};
  std::optional<FeedPoint> stem{};  // CO units
  std::optional<FeedName> mode{};
  ModeValues mode_values{};

  friend bool operator==(const FeedSettings&, const FeedSettings&) = default;
};

}  // namespace loopwarden::hal::feed
