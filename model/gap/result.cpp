// SPDX-License-Identifier: Apache-2.0
#include "model/gap/result.hpp"

namespace loopwarden::gap {

const char* to_text(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::missing_effect: return "missing_effect";
    case Verdict::no_gap: return "no_gap";
    case Verdict::unexplained: break;
  }
  return "unexplained";
}

const char* to_text(LooksLike what) noexcept {
  switch (what) {
    case LooksLike::disturbance: return "a disturbance";
    case LooksLike::valve: return "the valve";
    case LooksLike::process: return "the process";
    case LooksLike::controller: return "the controller";
    case LooksLike::compression: return "compression";
    case LooksLike::nothing_known: break;
  }
  return "nothing known";
}

const char* to_text(LocatedBy by) noexcept {
  switch (by) {
    case LocatedBy::block: return "block";
    case LocatedBy::time: return "time";
    case LocatedBy::condition: break;
  }
  return "condition";
}

}  // namespace loopwarden::gap
