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

const char* to_text(LocatedBy by) noexcept {
  switch (by) {
    case LocatedBy::block: return "block";
    case LocatedBy::time: return "time";
    case LocatedBy::condition: break;
  }
  return "condition";
}

}  // namespace loopwarden::gap
