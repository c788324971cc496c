// SPDX-License-Identifier: Apache-2.0
// What a loop's twin says beside its alarm: where it can't judge, what load it needs, what nothing has tested. Never a
// condition of an alarm.
//
// Of it, what is worth a line once (TwinNews): a load outside of the healthy record's as it comes and as it goes; that the
// loop has not been judged for kTold_s without a break, and that it is judged again.
//
// Errors: none.
// What it can't do: know of what was tested before a restart of the program.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "model/watch/load_watch.hpp"
#include "model/watch/twin_watch.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::watch {

// settling: too soon after a start, a return, or a jump of the load. outside: of what the healthy record showed of PV and CO.
enum class Judging : std::uint8_t { here, settling, outside };
constexpr const char* to_text(Judging judging) noexcept {
  return numeric::enum_name<Judging::outside>(judging, {"here", "settling", "outside"});
}

struct Untested {
  double for_s = 0.0;
  bool tested = false;  // before that; else never since the start
};

struct TwinRemarks {
  Judging judging = Judging::settling;
  std::optional<LoadOutside> load{};  // none while the twin's alarm is on: then it is no load
  std::array<Untested, kTwinChanges> untested{};
  std::optional<Untested> controller{};  // where it is watched
};

class TwinNews {
 public:
  static constexpr double kTold_s = 600.0;

  enum class Kind : std::uint8_t { load_outside, load_back, not_judged, judged_again };
  // `passed_s` of the loop's time after the last call. Nothing: no news. No allocation.
  std::optional<Kind> add(const TwinRemarks& remarks, double passed_s) noexcept {
    if (remarks.load.has_value() != load_) {
      load_ = !load_;
      return load_ ? Kind::load_outside : Kind::load_back;
    }
    unjudged_s_ = remarks.judging == Judging::here ? 0.0 : unjudged_s_ + passed_s;
    if ((unjudged_s_ >= kTold_s && !told_) || (unjudged_s_ == 0.0 && told_)) {
      told_ = !told_;
      return told_ ? Kind::not_judged : Kind::judged_again;
    }
    return std::nullopt;
  }

 private:
  double unjudged_s_ = 0.0;
  bool load_ = false;
  bool told_ = false;
};

}  // namespace loopwarden::watch
