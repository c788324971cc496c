// SPDX-License-Identifier: Apache-2.0
// Remarks of a loop's twin in addition to its alarm: whether it can judge, the load that explains
// PV, and the untested changes. A remark is never a condition of an alarm.
//
// TwinNews selects the remarks that deserve one line: a load leaves or re-enters the range of the
// healthy record; the loop has not been judged for kNotJudged_s without a break, and is judged
// again.
//
// No errors.
// Limits: tests before a restart of the program are unknown.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "model/watch/limits.hpp"
#include "model/watch/load_watch.hpp"
#include "model/watch/twin_watch.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::watch {

// settling: too soon after a start, a return, or a jump of the load. outside: beyond the PV and CO
// of the healthy record.
enum class Judging : std::uint8_t { here, settling, outside };
constexpr const char* to_text(Judging judging) noexcept {
  return numeric::enum_name<Judging::outside>(judging, {"here", "settling", "outside"});
}

struct Untested {
  double for_s = 0.0;
  bool tested = false;  // before that; otherwise not since the start
};

struct TwinRemarks {
  Judging judging = Judging::settling;
  std::optional<LoadOutside>
      load{};  // empty while the twin's alarm is on, because the difference is then no load
  std::array<Untested, kTwinChanges> untested{};
  std::optional<Untested> controller{};  // if it is watched
};

class TwinNews {
 public:
  enum class Kind : std::uint8_t { load_outside, load_back, not_judged, judged_again };
  // Adds remarks, `passed_s` of the loop's time after the last call. Returns the news, if any. No
  // allocation.
  std::optional<Kind> add(const TwinRemarks& remarks, double passed_s) noexcept {
    if (remarks.load.has_value() != load_) {
      load_ = !load_;
      return load_ ? Kind::load_outside : Kind::load_back;
    }
    unjudged_s_ = remarks.judging == Judging::here ? 0.0 : unjudged_s_ + passed_s;
    if ((unjudged_s_ >= Limits::kNotJudged_s && !told_) || (unjudged_s_ == 0.0 && told_)) {
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
