// SPDX-License-Identifier: Apache-2.0
// The laws that hypotheses are made of: the effects of the catalogue, and their laws at another
// place or time.
//
// Each law exists at each place of the loop. A backlash may be in the meter instead of the valve,
// and a lag may begin in the middle of the record. Such a combination has no name in the
// catalogue; the answer is `learned` with law, place and time in its description.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "model/effects/catalogue.hpp"
#include "model/effects/effect.hpp"

namespace loopwarden::estimator {

using effects::Candidate;

struct Law : effects::Candidate {
  enum class Timing : std::uint8_t {
    always,
    since,   // from a moment of the record on; the moment is one more searched parameter
    growing  // from nothing at the start to its full size at the end of the fitted part
  };
  Timing timing = Timing::always;
  bool named = true;            // in the catalogue
  double duration_s = 0.0;      // of the fitted part
  const char* words = nullptr;  // of a law at another place; null: from its name

  // Searched parameters, with the moment as the last one.
  std::size_t coordinates() const noexcept {
    return search.size() + (timing == Timing::since ? 1 : 0);
  }
  const effects::SearchRange& range(std::size_t i) const noexcept {
    return i < search.size() ? search[i] : moment;
  }
  effects::Schedule schedule(double moment_s) const noexcept;
  std::string description() const;  // "backlash in the transmitter"

  effects::SearchRange moment{"from", 0.0, 1.0, false, 12, 0.04};
};

// The effects of the catalogue.
std::vector<Law> named_laws(const std::vector<Candidate>& catalogue, double duration_s);
// The same laws at other places and times.
struct Ranges {
  double pv_over_co = 1.0;               // PV span over CO span
  double co_low = 0.0, co_high = 100.0;  // CO units, of the record
};
std::vector<Law> unnamed_laws(const std::vector<Candidate>& catalogue, double duration_s,
                              const Ranges& ranges);

}  // namespace loopwarden::estimator
